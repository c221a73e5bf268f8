"""Actuator test: single motors turn on the ground, for a time."""

import time
from typing import Any

import pytest
from pymavlink.dialects.v20 import common

ACTUATOR_TEST, DO_MOTOR_TEST, REQUEST_MESSAGE, SERVO_OUTPUT_RAW = 310, 209, 512, 36
ACCEPTED, UNSUPPORTED = 0, 3
DISARMED_PWM, SLOWEST_PWM = 900, 1000
LITTLE = 0.01
OPPOSITE = {"MAV_TYPE_HEXAROTOR": {1: 4, 3: 6}, "MAV_TYPE_QUADROTOR": {1: 2, 3: 4}}
"""PX4's simulation lets a tested motor tip a vehicle over on the ground, which has no friction there, and a calibration
wants it level: the opposite motor, tested for as long, tips it back."""
OUTPUTS = {"MAV_TYPE_HEXAROTOR": 6, "MAV_TYPE_QUADROTOR": 4}
LIMIT_S = 30.0
NAN = float("nan")

pytestmark = [
    pytest.mark.covers(
        "MAV_CMD_ACTUATOR_TEST", source="https://mavlink.io/en/messages/common.html#MAV_CMD_ACTUATOR_TEST"
    ),
    pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR"),
]


def kind(station: Any) -> str:
    return str(common.enums["MAV_TYPE"][station.vehicle_type].name)


def and_its_opposite(station: Any, motor: int) -> tuple[int, int]:
    return motor, OPPOSITE[kind(station)][motor]


def outputs(station: Any) -> tuple[float, list[int]]:
    """Vehicle time in seconds, and PWM of the motors' outputs, which are asked for where they are not streamed."""
    while station.link.recv_match(blocking=False) is not None:
        pass
    station.mav.command_long_send(station.system, 1, REQUEST_MESSAGE, 0, SERVO_OUTPUT_RAW, *(0.0,) * 6)
    message = station.receive("SERVO_OUTPUT_RAW")
    return message.time_usec / 1e6, [getattr(message, f"servo{n + 1}_raw") for n in range(OUTPUTS[kind(station)])]


def outputs_when(station: Any, motor: int, turns: bool) -> tuple[float, list[int]]:
    """The first outputs in which a motor turns, or stands."""
    end_s = time.monotonic() + LIMIT_S
    while time.monotonic() < end_s:
        time_s, pwm = outputs(station)
        if (pwm[motor] >= SLOWEST_PWM) is turns:
            return time_s, pwm
    raise TimeoutError(f"motor {motor + 1} {'stands' if turns else 'turns'} after {LIMIT_S} s")


def actuator_test(station: Any, value: float, seconds: float, function: float) -> int | None:
    result: int | None = station.command(ACTUATOR_TEST, value, seconds, 0, 0, function)
    return result


@pytest.mark.covers(
    "SERVO_OUTPUT_RAW",
    source="PX4 src/modules/simulation/pwm_out_sim/PWMSim.hpp: a disarmed output of the simulation stands at 900 µs",
)
def test_a_motor_turns_until_its_time_is_over(station: Any) -> None:
    for motor in and_its_opposite(station, 3):
        began_s, standing = outputs(station)
        assert set(standing) == {DISARMED_PWM}
        assert actuator_test(station, LITTLE, 1.5, motor) == ACCEPTED
        _, turning = outputs_when(station, motor - 1, turns=True)
        assert turning.pop(motor - 1) > SLOWEST_PWM
        assert set(turning) == {DISARMED_PWM}
        ended_s, standing = outputs_when(station, motor - 1, turns=False)
        assert set(standing) == {DISARMED_PWM}
        assert ended_s - began_s > 1.4


def test_a_motor_is_released_before_its_time(station: Any) -> None:
    for motor in and_its_opposite(station, 1):
        assert actuator_test(station, LITTLE, 30.0, motor) == ACCEPTED
        outputs_when(station, motor - 1, turns=True)
        assert actuator_test(station, NAN, 0.0, motor) == ACCEPTED
        _, standing = outputs_when(station, motor - 1, turns=False)
        assert set(standing) == {DISARMED_PWM}


@pytest.mark.covers(
    "COMMAND_ACK",
    source="measured terminal/ground/actuator_test: no ack for an output function that PX4 cannot test, as 0 or 101",
)
@pytest.mark.parametrize("function", [0, 101])
def test_no_answer_for_other_functions(station: Any, function: int) -> None:
    station.mav.command_long_send(station.system, 1, ACTUATOR_TEST, 0, 0.1, 1, 0, 0, function, 0, 0)
    assert ACTUATOR_TEST not in [ack.command for ack in station.collect("COMMAND_ACK", 0.9)]


@pytest.mark.covers(
    "MAV_CMD_DO_MOTOR_TEST",
    source="measured terminal/ground/motor_test: unsupported; PX4 has ACTUATOR_TEST in its place",
)
def test_the_older_motor_test_is_gone(station: Any) -> None:
    assert station.command(DO_MOTOR_TEST, 1, 0, 10, 1) == UNSUPPORTED
