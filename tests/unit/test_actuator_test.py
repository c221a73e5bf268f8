"""ACTUATOR_TEST: from the command to the motor of a vehicle that stands, and to its end."""

import math

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.control.mc_allocation import MulticopterAllocation
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import ActuatorArmed, ActuatorTest, Topics, VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

ACTUATOR_TEST, ARM_DISARM = 310, 400
ACCEPTED, DENIED = 0, 2
TEST_MODE, SAFETY_ARMED = 2, 128
TICKS_PER_S = 250


class Bench:
    """An autopilot and its simulator, tick by tick."""

    def __init__(self, model: str) -> None:
        data = vehicles.load(model)
        self.autopilot = Autopilot(data.airframe, 0)
        self.simulator = VehicleSimulator(data, Home(47.4, 8.5, 489.0, 0.0), seed=1, terrain=FlatGround())
        self.controls: HilActuatorControls | None = None
        self.run(0.1)

    def run(self, seconds: float) -> None:
        """Let time go by."""
        for _ in range(round(seconds * TICKS_PER_S)):
            self.controls = self.autopilot.step(self.simulator.tick(self.controls))

    def test(self, value: float, seconds: float, function: float) -> int | None:
        """The result of an ACTUATOR_TEST."""
        command = VehicleCommand(ACTUATOR_TEST, value, seconds, 0.0, 0.0, function)
        answer = self.autopilot.commands.handle(self.autopilot.now_us, command)
        return None if answer is None else answer.result

    @property
    def pwm(self) -> list[float]:
        """As SERVO_OUTPUT_RAW shows it."""
        return list(self.autopilot.topics.actuator_outputs.pwm)


@pytest.fixture(scope="module")
def hexacopter() -> Bench:
    return Bench("sihsim_hex")


def test_a_motor_turns_for_its_time(hexacopter: Bench) -> None:
    assert hexacopter.test(0.16, 1.0, 2) == ACCEPTED
    hexacopter.run(0.5)
    assert hexacopter.pwm == [900, 1400, 900, 900, 900, 900]  # THR_MDL_FAC 1: the root of the thrust
    assert hexacopter.controls is not None
    assert hexacopter.controls.controls == pytest.approx((0.0, 0.4, 0.0, 0.0, 0.0, 0.0))
    assert hexacopter.controls.mode == TEST_MODE
    assert hexacopter.simulator.dynamics.running
    hexacopter.run(0.52)
    assert hexacopter.pwm == [900] * 6
    hexacopter.run(0.1)
    assert hexacopter.controls.mode == 0
    assert hexacopter.controls.controls == (0.0,) * 6


def test_motors_are_released_one_by_one(hexacopter: Bench) -> None:
    for motor in (1, 3):
        assert hexacopter.test(0.0, 3.0, motor) == ACCEPTED
        hexacopter.run(0.02)
    assert hexacopter.pwm == [1000, 900, 1000, 900, 900, 900]
    hexacopter.test(math.nan, 0.0, 1)
    hexacopter.run(0.02)
    assert hexacopter.pwm == [900, 900, 1000, 900, 900, 900]
    hexacopter.test(math.nan, 0.0, 3)
    hexacopter.run(0.1)
    assert hexacopter.pwm == [900] * 6


def test_while_it_is_killed_no_motor_is_tried_out_and_the_time_goes_on() -> None:
    topics, parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, vehicles.load("sihsim_hex").airframe)
    allocation = MulticopterAllocation(topics, parameters, Texts())
    topics.actuator_test = ActuatorTest(1, 102, 0.25, 1_000_000)
    pulses: list[float] = []
    for now_us, kill in ((4000, True), (500_000, False), (600_000, True), (1_100_000, False)):
        topics.actuator_armed = ActuatorArmed(kill=kill)
        allocation.allocate(now_us, (0.0, 0.0, 0.0), 0.0, told=True, status_told=False)
        pulses.append(topics.actuator_outputs.pwm[1])
    assert pulses == [900, 1500, 900, 900]


def test_a_reversed_output_is_tried_out_reversed() -> None:
    airframe = {**vehicles.load("sihsim_hex").airframe, "PWM_MAIN_REV": 0b10}
    topics, parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, airframe)
    allocation = MulticopterAllocation(topics, parameters, Texts())
    topics.actuator_test = ActuatorTest(1, 102, 0.16, 1_000_000)
    allocation.allocate(4000, (0.0, 0.0, 0.0), 0.0, told=True, status_told=False)
    assert list(topics.actuator_outputs.pwm) == [900, 1600, 900, 900, 900, 900]
    topics.actuator_armed = ActuatorArmed(armed=True)
    for number in range(1, 3):
        allocation.allocate(number * 4000, (0.0, 0.0, 0.0), -0.16, told=number == 1, status_told=False)
        assert topics.actuator_outputs.controls[:2] == pytest.approx((0.4, 0.6), abs=1e-3)
        assert topics.actuator_outputs.pwm[:2] == (1400, 1600)


def test_a_motor_that_turns_both_ways_stands_still_in_the_middle_of_its_pulses() -> None:
    """FunctionMotors::updateValues; tried out, too (ActuatorTest::update)."""
    airframe = {**vehicles.load("sihsim_hex").airframe, "CA_R_REV": 0b10}
    topics, parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, airframe)
    allocation = MulticopterAllocation(topics, parameters, Texts())
    topics.actuator_test = ActuatorTest(1, 102, -0.16, 1_000_000)
    allocation.allocate(4000, (0.0, 0.0, 0.0), 0.0, told=True, status_told=False)
    assert topics.actuator_outputs.controls[1] == pytest.approx(-0.4)
    assert topics.actuator_outputs.pwm[:2] == pytest.approx((900.0, 1300.0))
    topics.actuator_armed = ActuatorArmed(armed=True)
    allocation.allocate(8000, (0.0, 0.0, 0.0), -0.16, told=True, status_told=False)
    assert topics.actuator_outputs.controls[:2] == pytest.approx((0.4, 0.4))
    assert topics.actuator_outputs.pwm[:2] == pytest.approx((1400.0, 1700.0))


def test_no_longer_than_three_seconds_and_px4_s_own_numbers(hexacopter: Bench) -> None:
    assert hexacopter.test(1.0, 60.0, 1106) == ACCEPTED
    hexacopter.run(2.9)
    assert hexacopter.pwm[5] == 2000
    hexacopter.run(0.2)
    assert hexacopter.pwm[5] == 900


@pytest.mark.parametrize("function", [0, 13, 32, 48, 101, 999, math.nan])
def test_functions_that_px4_does_not_know_get_no_ack(hexacopter: Bench, function: float) -> None:
    assert hexacopter.test(0.1, 1.0, function) is None


@pytest.mark.parametrize(("function", "tested"), [(41, 209), (47, 215), (-1, 64535), (1048, 48)])
def test_servos_and_functions_of_no_output_are_accepted(hexacopter: Bench, function: float, tested: int) -> None:
    """msg/ActuatorTest.msg: 15 servos, and a function of 16 bits without a sign."""
    assert hexacopter.test(0.1, 1.0, function) == ACCEPTED
    assert hexacopter.autopilot.topics.actuator_test.function == tested


def test_nothing_is_tested_while_armed(hexacopter: Bench) -> None:
    commands, topics = hexacopter.autopilot.commands, hexacopter.autopilot.topics
    forced = VehicleCommand(ARM_DISARM, 1.0, 21196.0, from_external=False)
    assert commands.handle(hexacopter.autopilot.now_us, forced) == (ACCEPTED, 0, 0)
    before = topics.actuator_test
    assert hexacopter.test(1.0, 1.0, 1) == DENIED
    assert topics.actuator_test is before
    commands.handle(hexacopter.autopilot.now_us, VehicleCommand(ARM_DISARM, 0.0, 21196.0))


def test_a_disarmed_rover_is_told_nothing() -> None:
    """PX4 accepts the test, but its simulated outputs speak only with a motor's own topic."""
    rover = Bench("sihsim_rover_ackermann")
    before = rover.autopilot.topics.actuator_outputs
    assert rover.test(0.5, 1.0, 1) == ACCEPTED
    rover.run(0.9)
    assert rover.autopilot.topics.actuator_outputs is before
    assert rover.simulator.dynamics.north_m == pytest.approx(0.0, abs=0.05)
