"""ACTUATOR_GROUP_TEST: when it may run, what it makes of the controls, and how it ends."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.control.actuator_group_test import ActuatorGroupTest
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import ActuatorArmed, Topics, VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind

from .test_actuator_test import Bench

GROUP_TEST, ARM_DISARM = 309, 400
ACCEPTED, TEMPORARILY_REJECTED, UNSUPPORTED, IN_PROGRESS, CANCELLED = 0, 1, 3, 5, 6
LEAST_PWM = round(1000 + 1000 * math.sqrt(2 * 0.001))
"""Of motors that share the thrust that PX4 always keeps (PositionControl::setThrustLimits), behind THR_MDL_FAC 1."""
ROLL, PITCH, YAW, TILT, X_THRUST, Z_THRUST = 0, 1, 2, 3, 4, 6


class Desk:
    """The module alone, of a vehicle that stands."""

    def __init__(self, armed: bool = False, prearm_mode: int = 0) -> None:
        self.topics, self.texts = Topics(), Texts()
        self.topics.actuator_armed = ActuatorArmed(armed)
        parameters = Parameters(VehicleKind.MULTICOPTER, {"COM_PREARM_MODE": prearm_mode})
        self.tests = ActuatorGroupTest(self.topics, parameters, self.texts)
        self.now_us = 10_000_000

    def ask(self, group: float, value: float = 0.5) -> int | None:
        """The first answer."""
        answer = self.tests.handle_command(self.now_us, VehicleCommand(GROUP_TEST, group, value))
        return None if answer is None else answer.result

    def after(self, seconds: float) -> list[tuple[float, int]]:
        """(param1 of the command, result) of the answers until then."""
        self.now_us += round(seconds * 1e6)
        self.tests.update(self.now_us)
        acks, self.topics.vehicle_command_acks = self.topics.vehicle_command_acks, ()
        return [(ack.command.param1, ack.result) for ack in acks]

    def take_off(self) -> None:
        """The land detector notices."""
        self.topics.vehicle_land_detected = self.topics.vehicle_land_detected._replace(landed=False)


@pytest.mark.parametrize("group", [TILT, 7, 255, -1])
def test_groups_that_a_multicopter_lacks_are_unsupported(group: float) -> None:
    assert Desk(armed=True).ask(group) == UNSUPPORTED


@pytest.mark.parametrize("group", [ROLL, YAW, X_THRUST, Z_THRUST, 0.4, 256, math.nan])
def test_neither_prearmed_nor_armed_nothing_is_tested(group: float) -> None:
    assert Desk(prearm_mode=1).ask(group) == TEMPORARILY_REJECTED


def test_prearmed_is_enough_for_a_torque() -> None:
    desk = Desk(prearm_mode=2)
    assert desk.ask(Z_THRUST) == TEMPORARILY_REJECTED
    assert desk.ask(PITCH) == IN_PROGRESS
    desk.now_us = 5_000_000
    assert desk.ask(PITCH) == TEMPORARILY_REJECTED
    said = [line.line.partition("rejected ")[2] for line in desk.texts.lines]
    assert said == ["(thrust test requires armed)", "(not (pre)armed)"]


def test_it_lasts_half_a_second() -> None:
    desk = Desk(armed=True)
    assert desk.ask(ROLL) == IN_PROGRESS
    assert desk.after(0.48) == []
    assert desk.after(0.02) == [(ROLL, ACCEPTED)]
    assert desk.after(1.0) == []


def test_one_control_is_replaced_within_its_range() -> None:
    desk = Desk(armed=True)
    assert desk.tests.applied(0.1, 0.2, 0.3, -0.4) == (0.1, 0.2, 0.3, -0.4)
    for group, value, controls in (
        (ROLL, 0.5, (0.5, 0.2, 0.3, -0.4)),
        (PITCH, -3.0, (0.1, -1.0, 0.3, -0.4)),
        (YAW, math.inf, (0.1, 0.2, 0.0, -0.4)),
        (X_THRUST, 0.5, (0.1, 0.2, 0.3, -0.4)),
        (Z_THRUST, math.nan, (0.1, 0.2, 0.3, 0.0)),
    ):
        desk.ask(group, value)
        assert desk.tests.applied(0.1, 0.2, 0.3, -0.4) == controls


def test_disarming_taking_off_and_another_mode_end_it() -> None:
    desk = Desk(armed=True)
    assert desk.ask(Z_THRUST) == IN_PROGRESS
    desk.topics.actuator_armed = ActuatorArmed(armed=False)
    assert desk.after(0.02) == [(Z_THRUST, CANCELLED)]
    desk.topics.actuator_armed = ActuatorArmed(armed=True)
    assert desk.ask(YAW) == IN_PROGRESS
    desk.topics.vehicle_status = desk.topics.vehicle_status._replace(nav_state=NavState.STAB)
    assert desk.after(0.02) == [(YAW, CANCELLED)]
    assert desk.ask(ROLL) == IN_PROGRESS
    desk.take_off()
    assert desk.after(0.02) == [(ROLL, CANCELLED)]
    assert desk.ask(ROLL) == TEMPORARILY_REJECTED


def test_another_test_takes_its_place() -> None:
    desk = Desk(armed=True)
    assert desk.ask(ROLL) == IN_PROGRESS
    assert desk.ask(TILT) == UNSUPPORTED
    assert desk.ask(YAW) is None
    assert desk.after(0.4) == [(ROLL, CANCELLED), (YAW, IN_PROGRESS)]
    assert desk.after(0.1) == [(YAW, ACCEPTED)]


def test_a_hexacopter_turns_all_motors_for_a_thrust() -> None:
    bench = Bench("sihsim_hex")
    bench.run(2.0)
    commands = bench.autopilot.commands
    commands.handle(bench.autopilot.now_us, VehicleCommand(ARM_DISARM, 1.0, 21196.0, from_external=False))
    bench.run(0.1)
    assert max(bench.pwm) <= LEAST_PWM
    answer = commands.handle(bench.autopilot.now_us, VehicleCommand(GROUP_TEST, Z_THRUST, -0.2))
    assert answer is not None
    assert answer.result == IN_PROGRESS
    bench.run(0.3)
    assert all(1350 < pwm < 1550 for pwm in bench.pwm)
    bench.run(0.3)
    assert max(bench.pwm) <= LEAST_PWM


def test_a_rover_does_not_answer() -> None:
    bench = Bench("sihsim_rover_ackermann")
    assert bench.autopilot.commands.handle(bench.autopilot.now_us, VehicleCommand(GROUP_TEST, ROLL, 0.5)) is None
