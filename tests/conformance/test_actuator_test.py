"""Actuator test: single motors turn on the ground, for a time."""

import time
from typing import Any

import pytest

ACTUATOR_TEST, DO_MOTOR_TEST, REQUEST_MESSAGE, SERVO_OUTPUT_RAW = 310, 209, 512, 36
ACCEPTED, UNSUPPORTED = 0, 3
DISARMED_PWM, SLOWEST_PWM = 900, 1000
LITTLE = 0.01
"""Thrust of a tested motor. PX4's simulation tips a vehicle on the ground over by it; the opposite one (1 and 2, 3 and
4 of a hexacopter and of a quadcopter) tips it back."""
LIMIT_S = 30.0
NAN = float("nan")

pytestmark = [
    pytest.mark.covers(
        "MAV_CMD_ACTUATOR_TEST", source="https://mavlink.io/en/messages/common.html#MAV_CMD_ACTUATOR_TEST"
    ),
    pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR"),
]


def outputs(station: Any) -> tuple[float, list[int]]:
    """Vehicle time in seconds, and PWM of the first four outputs, which are asked for where they are not streamed."""
    while station.link.recv_match(blocking=False) is not None:
        pass
    station.mav.command_long_send(station.system, 1, REQUEST_MESSAGE, 0, SERVO_OUTPUT_RAW, *(0.0,) * 6)
    message = station.receive("SERVO_OUTPUT_RAW")
    return message.time_usec / 1e6, [getattr(message, f"servo{n}_raw") for n in range(1, 5)]


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
@pytest.mark.parametrize("motor", [3, 4])
def test_a_motor_turns_until_its_time_is_over(station: Any, motor: int) -> None:
    began_s, standing = outputs(station)
    assert standing == [DISARMED_PWM] * 4
    assert actuator_test(station, LITTLE, 1.5, motor) == ACCEPTED
    _, turning = outputs_when(station, motor - 1, turns=True)
    assert turning.pop(motor - 1) > SLOWEST_PWM
    assert turning == [DISARMED_PWM] * 3
    ended_s, standing = outputs_when(station, motor - 1, turns=False)
    assert standing == [DISARMED_PWM] * 4
    assert ended_s - began_s > 1.4


@pytest.mark.parametrize("motor", [1, 2])
def test_a_motor_is_released_before_its_time(station: Any, motor: int) -> None:
    assert actuator_test(station, LITTLE, 30.0, motor) == ACCEPTED
    outputs_when(station, motor - 1, turns=True)
    assert actuator_test(station, NAN, 0.0, motor) == ACCEPTED
    _, standing = outputs_when(station, motor - 1, turns=False)
    assert standing == [DISARMED_PWM] * 4


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
