"""DO_SET_ACTUATOR and the gripper: from the command to the outputs that carry them."""

import math

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.control.peripherals import with_peripherals
from sitl_emu.autopilot.topics import ActuatorOutputs, LandingGear, ManualControlSetpoint
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator
from tests.unit.vehicle_command import vehicle_command

DO_SET_ACTUATOR, DO_GRIPPER, ARM_DISARM, FORCE = 187, 211, 400, 21196.0
ACCEPTED, IN_PROGRESS = 0, 5
RELEASE = 0.0
TICKS_PER_S = 250


class Bench:
    """An autopilot with more on its outputs, and its simulator."""

    def __init__(self, model: str, **parameters: float) -> None:
        data = vehicles.load(model)
        airframe = {**data.airframe, **parameters}
        self.autopilot = Autopilot(airframe, 0)
        self.simulator = VehicleSimulator(data, Home(47.4, 8.5, 489.0, 0.0), seed=1, terrain=FlatGround())
        self.controls: HilActuatorControls | None = None
        self.run(12.0)  # until it knows where it is

    def run(self, seconds: float) -> None:
        """Let time go by."""
        for _ in range(round(seconds * TICKS_PER_S)):
            self.controls = self.autopilot.step(self.simulator.tick(self.controls))

    def command(self, number: int, *values: float) -> int | None:
        """The result, a moment later."""
        answer = self.autopilot.commands.handle(self.autopilot.now_us, vehicle_command(number, *values))
        self.run(0.1)
        return None if answer is None else answer.result

    @property
    def pwm(self) -> list[float]:
        """As SERVO_OUTPUT_RAW shows it."""
        return list(self.autopilot.topics.actuator_outputs.pwm)


def test_an_actuator_moves_while_armed() -> None:
    bench = Bench("sihsim_hex", PWM_MAIN_FUNC7=302, PWM_MAIN_FUNC8=301)
    assert bench.command(DO_SET_ACTUATOR, math.nan, 0.5, *(math.nan,) * 4, 0.0) == ACCEPTED
    assert bench.pwm == [900] * 8
    assert bench.command(ARM_DISARM, 1.0, FORCE) == ACCEPTED
    assert bench.pwm[6:] == [1750, 900]
    assert bench.controls is not None
    assert bench.controls.controls[6:] == (0.5, 0.0)
    assert bench.command(DO_SET_ACTUATOR, -1.0, *(math.nan,) * 5, 0.0) == ACCEPTED
    assert bench.pwm[6:] == [1750, 1000]
    assert bench.command(DO_SET_ACTUATOR, *(0.0,) * 6, 1.0) == ACCEPTED  # there is no second set
    assert bench.pwm[6:] == [1750, 1000]
    assert bench.command(ARM_DISARM, 0.0, FORCE) == ACCEPTED
    assert bench.pwm == [900] * 8


def test_a_gripper_on_an_output() -> None:
    bench = Bench("sihsim_rover_ackermann", PWM_MAIN_FUNC4=430, PD_GRIPPER_TYPE=0)
    assert bench.command(ARM_DISARM, 1.0, FORCE) == ACCEPTED
    assert bench.pwm[3] == 2000
    assert bench.command(DO_GRIPPER, 1.0, RELEASE) == IN_PROGRESS
    assert bench.pwm[3] == 1000


def test_outputs_at_an_end_and_of_gear_parachute_and_sticks() -> None:
    """As a real PX4 v1.18 told in SERVO_OUTPUT_RAW; sticks that are lost let go of their outputs."""
    functions = {"PWM_MAIN_FUNC7": 1, "PWM_MAIN_FUNC8": 2, "PWM_MAIN_FUNC9": 400, "PWM_MAIN_FUNC10": 401}
    sticks = {"PWM_MAIN_FUNC11": 402, "PWM_MAIN_FUNC12": 404, "PWM_MAIN_FUNC13": 407}
    bench = Bench("sihsim_hex", **functions, **sticks, PWM_MAIN_FUNC14=420, PWM_MAIN_FUNC15=440)
    assert bench.pwm == [900] * 15
    assert bench.command(ARM_DISARM, 1.0, FORCE) == ACCEPTED
    assert bench.pwm[6:] == [1000, 2000, 1000, 1000, 900, 900, 900, 900, 1500]
    topics = bench.autopilot.topics
    topics.manual_control_setpoint = ManualControlSetpoint(
        bench.autopilot.now_us, True, roll=0.5, throttle=-1.0, aux=(0.2, 0.0, 0.0, 0.0, 0.0, 0.0)
    )
    topics.landing_gear = LandingGear(bench.autopilot.now_us, 1)
    outputs = with_peripherals(topics, [400, 402, 404, 407], ActuatorOutputs(0, (0.0,) * 4, (900.0,) * 4))
    assert outputs.pwm == (2000, 1750, 1000, 1600)
