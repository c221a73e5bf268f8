"""What an output carries for a setpoint (PX4's mixer_module.cpp, FunctionMotors.hpp, PWMSim.cpp)."""

import math

import pytest

from sitl_emu.autopilot.control.mixer import direct_outputs, mirrored, output, unchanged
from sitl_emu.autopilot.topics import ActuatorMotors, ActuatorOutputs, ActuatorServos, DirectActuator

NAN, INF = math.nan, math.inf
MOTOR, SERVO = 101, 201
OFF = (0.0, 900)


@pytest.mark.parametrize(
    ("function", "value", "reversible", "told"),
    [
        (MOTOR, 0.25, False, (0.5, 1500)),
        (MOTOR, 7.0, False, (1.0, 2000)),
        (MOTOR, 0.0, False, (0.0, 1000)),
        (MOTOR, -0.25, False, OFF),
        (MOTOR, NAN, False, OFF),
        (MOTOR, INF, True, OFF),
        (MOTOR, -0.25, True, (-0.5, 1250)),
        (MOTOR, 0.0, True, (0.0, 1500)),
        (SERVO, -0.5, False, (-0.5, 1250)),
        (SERVO, -3.0, False, (-1.0, 1000)),
        (SERVO, NAN, False, OFF),
        (MOTOR, 1e-6, False, (1e-3, 1001.0)),
        (SERVO, 0.0625, False, (0.0625, 1531.25)),
    ],
)
def test_an_output(function: int, value: float, reversible: bool, told: tuple[float, float]) -> None:
    """With THR_MDL_FAC 1 a quarter of the thrust is half of the signal; servos have no curve."""
    assert output(function, value, math.sqrt, reversible=reversible) == pytest.approx(told)


def test_each_output_finds_its_motor_or_servo() -> None:
    told = DirectActuator(ActuatorMotors(1, (0.1, 0.2), 0b10), ActuatorServos(1, (0.3,)))
    outputs = direct_outputs(7, [102, 201, 101, 0, 103, 202], told, unchanged)
    assert outputs.timestamp == 7
    assert outputs.controls == (0.2, 0.3, 0.1, 0.0, 0.0, 0.0)
    assert outputs.pwm == (1600, 1650, 1100, 900, 900, 900)


def test_outputs_are_turned_round_by_pwm_main_rev() -> None:
    """A servo, a motor that turns one way, one that is off, and a motor that turns both ways."""
    outputs = ActuatorOutputs(7, (0.5, 0.25, 0.0, 0.5), (1750, 1250, 900, 1750))
    functions = [SERVO, MOTOR, MOTOR + 1, 0]
    turned = mirrored(outputs, functions, 0b0111, reversible_flags=0)
    assert (turned.controls, turned.pwm) == ((-0.5, 0.75, 0.0, 0.5), (1250, 1750, 900, 1750))
    both_ways = mirrored(outputs, [SERVO, SERVO, SERVO, MOTOR], 0b1000, reversible_flags=1)
    assert (both_ways.controls[3], both_ways.pwm[3]) == (-0.5, 1250)
    assert mirrored(outputs, functions, 0, reversible_flags=0) is outputs
