"""Outputs that carry neither a motor nor a servo: one that stands at an end, the actuator set, landing gear and
parachute, sticks and the channels beside them, and the gripper.

PX4's functions of its mixer library (src/lib/mixer_module/functions, v1.18). As long as nobody has set an actuator, its
output stays at the disarmed value, as those of sticks do that are lost; so do all while the vehicle is disarmed.

An output of a gimbal or of an engine with ignition is never told anything, a landing gear's wheel is straight.

Left out: a gimbal on outputs (MNT_MODE_OUT 0), and in a termination the parachute.
"""

import math
from collections.abc import Sequence
from typing import Final

from sitl_emu.autopilot.constants import GEAR_UP
from sitl_emu.autopilot.control.mixer import CENTRED_PWM, CENTRED_PWM_RANGE, PWM_DISARMED
from sitl_emu.autopilot.topics import ActuatorOutputs, Topics

CONSTANT_MIN: Final = 1
CONSTANT_MAX: Final = 2
FIRST_ACTUATOR: Final = 301
LAST_ACTUATOR: Final = 306
"""Peripheral via actuator set 1 to 6: MAV_CMD_DO_SET_ACTUATOR."""
LANDING_GEAR: Final = 400
PARACHUTE: Final = 401
FIRST_STICK: Final = 402
LAST_STICK: Final = 412
"""Roll, pitch, throttle, yaw, flaps, and six channels beside them."""
GRIPPER: Final = 430
LANDING_GEAR_WHEEL: Final = 440
SILENT: Final = frozenset((420, 421, 422, 450, 451, 452, 453))
"""Gimbal roll, pitch, yaw; an engine's ignition, throttle, choke and starter."""
OTHERS: Final = SILENT | {CONSTANT_MIN, CONSTANT_MAX, LANDING_GEAR, LANDING_GEAR_WHEEL, PARACHUTE, GRIPPER}
NO_FLAPS: Final = 0.0
"""Nobody has a switch for them here."""


def carried(function: int) -> bool:
    """Whether this PWM_MAIN_FUNCn is one of these."""
    return FIRST_ACTUATOR <= function <= LAST_ACTUATOR or FIRST_STICK <= function <= LAST_STICK or function in OTHERS


def with_peripherals(topics: Topics, functions: Sequence[int], outputs: ActuatorOutputs) -> ActuatorOutputs:
    """`outputs` of an armed vehicle, and in their places what is neither motor nor servo."""
    controls, pwm = list(outputs.controls), list(outputs.pwm)
    for channel, function in enumerate(functions[: len(pwm)]):
        if carried(function):
            controls[channel], pwm[channel] = _output(topics, function)
    return outputs._replace(controls=tuple(controls), pwm=tuple(pwm))


def _output(topics: Topics, function: int) -> tuple[float, float]:
    """-1..1, and microseconds."""
    value = _value(topics, function)
    if value != value:
        return 0.0, PWM_DISARMED
    value = max(-1.0, min(1.0, value))
    return value, CENTRED_PWM + CENTRED_PWM_RANGE * value


def _value(topics: Topics, function: int) -> float:
    """-1..1, NaN where nothing is said."""
    if FIRST_ACTUATOR <= function <= LAST_ACTUATOR:
        return topics.actuator_set.values[function - FIRST_ACTUATOR]
    if FIRST_STICK <= function <= LAST_STICK:
        sticks = topics.manual_control_setpoint
        values = (sticks.roll, sticks.pitch, sticks.throttle, sticks.yaw, NO_FLAPS, *sticks.aux)
        return values[function - FIRST_STICK] if sticks.valid else math.nan
    if function == GRIPPER:
        return topics.gripper.position
    if function in SILENT:
        return math.nan
    if function == LANDING_GEAR_WHEEL:
        return 0.0
    is_up = function == LANDING_GEAR and topics.landing_gear.landing_gear == GEAR_UP
    return 1.0 if is_up or function == CONSTANT_MAX else -1.0


def last_used(functions: Sequence[int], used: Sequence[bool]) -> int:
    """How many outputs there are, up to the last that carries something: `used`, or one of these."""
    count = len(functions)
    while count and not used[count - 1] and not carried(functions[count - 1]):
        count -= 1
    return count
