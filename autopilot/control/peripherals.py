"""Outputs that carry neither a motor nor a servo: the actuator set, and the gripper.

PX4's FunctionActuatorSet and FunctionGripper in its mixer library (src/lib/mixer_module/functions, v1.18). As long as
nobody has set an actuator, its output stays at the disarmed value; so do all while the vehicle is disarmed.
"""

from collections.abc import Sequence
from typing import Final

from sitl_emu.autopilot.control.mixer import CENTRED_PWM, CENTRED_PWM_RANGE, PWM_DISARMED
from sitl_emu.autopilot.topics import ActuatorOutputs, Topics

FIRST_ACTUATOR: Final = 301
LAST_ACTUATOR: Final = 306
"""Peripheral via actuator set 1 to 6: MAV_CMD_DO_SET_ACTUATOR."""
GRIPPER: Final = 430


def carried(function: int) -> bool:
    """Whether this PWM_MAIN_FUNCn is one of these."""
    return FIRST_ACTUATOR <= function <= LAST_ACTUATOR or function == GRIPPER


def with_peripherals(topics: Topics, functions: Sequence[int], outputs: ActuatorOutputs) -> ActuatorOutputs:
    """`outputs` of an armed vehicle, and in their places what is neither motor nor servo."""
    controls, pwm = list(outputs.controls), list(outputs.pwm)
    for channel, function in enumerate(functions[: len(pwm)]):
        if carried(function):
            controls[channel], pwm[channel] = _output(topics, function)
    return outputs._replace(controls=tuple(controls), pwm=tuple(pwm))


def _output(topics: Topics, function: int) -> tuple[float, float]:
    """-1..1, and microseconds."""
    gripper, actuators = topics.gripper.position, topics.actuator_set.values
    value = gripper if function == GRIPPER else actuators[function - FIRST_ACTUATOR]
    if value != value:
        return 0.0, PWM_DISARMED
    value = max(-1.0, min(1.0, value))
    return value, CENTRED_PWM + CENTRED_PWM_RANGE * value


def last_used(functions: Sequence[int], used: Sequence[bool]) -> int:
    """How many outputs there are, up to the last that carries something: `used`, or one of these."""
    count = len(functions)
    while count and not used[count - 1] and not carried(functions[count - 1]):
        count -= 1
    return count
