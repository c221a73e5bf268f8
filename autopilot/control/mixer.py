"""What an output carries for a motor's or a servo's setpoint: PX4's mixer library (src/lib/mixer_module, v1.18).

Controls are those of HIL_ACTUATOR_CONTROLS as PWMSim tells them, pulses those of SERVO_OUTPUT_RAW.
"""

import math
from collections.abc import Callable, Sequence
from typing import Final

from sitl_emu.autopilot.topics import ActuatorOutputs, DirectActuator

FIRST_MOTOR: Final = 101
LAST_MOTOR: Final = 112
FIRST_SERVO: Final = 201
LAST_SERVO: Final = 215
"""PWM_MAIN_FUNCn (output_functions.yaml)."""
OUTPUTS: Final = 16
PWM_DISARMED: Final = 900.0
MOTOR_PWM_MIN: Final = 1000.0
MOTOR_PWM_RANGE: Final = 1000.0
CENTRED_PWM: Final = 1500.0
CENTRED_PWM_RANGE: Final = 500.0
"""PWMSim.hpp."""
NO_PULSES: Final = (PWM_DISARMED,) * OUTPUTS


def is_motor(function: int) -> bool:
    """Whether an output of this function carries a motor."""
    return FIRST_MOTOR <= function <= LAST_MOTOR


def is_servo(function: int) -> bool:
    """Whether an output of this function carries a servo."""
    return FIRST_SERVO <= function <= LAST_SERVO


def all_pulses(outputs: ActuatorOutputs) -> tuple[float, ...]:
    """The pulses of all outputs; one without a function stands at its disarmed value (MixingOutput::update)."""
    pwm = outputs.pwm[:OUTPUTS]
    return pwm + NO_PULSES[len(pwm) :]


def output(function: int, value: float, curve: Callable[[float], float], *, reversible: bool) -> tuple[float, float]:
    """Control and pulse of a motor or a servo; `curve` makes a motor's signal of a thrust (THR_MDL_FAC).

    What is no number stands at its disarmed value, and so does a motor that is told to turn backwards and can't.
    """
    motor = is_motor(function)
    if not math.isfinite(value) or (motor and not reversible and value < 0.0):
        return 0.0, PWM_DISARMED
    value = max(-1.0, min(1.0, value))
    if not motor:
        return value, CENTRED_PWM + CENTRED_PWM_RANGE * value
    signal = math.copysign(curve(abs(value)), value)
    if reversible:
        return signal, CENTRED_PWM + CENTRED_PWM_RANGE * signal
    return signal, MOTOR_PWM_MIN + MOTOR_PWM_RANGE * signal


def unchanged(thrust: float) -> float:
    """The curve of a motor that has none."""
    return thrust


def direct_outputs(
    now_us: int, functions: Sequence[int], told: DirectActuator, curve: Callable[[float], float]
) -> ActuatorOutputs:
    """All outputs as ROS 2 tells them; those that are neither motor nor servo stand at their disarmed value."""

    def one(function: int) -> tuple[float, float]:
        if is_motor(function):
            number = function - FIRST_MOTOR
            reversible = turns_both_ways(function, told.motors.reversible_flags)
            return output(function, _at(told.motors.control, number), curve, reversible=reversible)
        place = _at(told.servos.control, function - FIRST_SERVO) if is_servo(function) else math.nan
        return output(function, place, curve, reversible=False)

    outputs = [one(function) for function in functions]
    return ActuatorOutputs(now_us, tuple(control for control, _ in outputs), tuple(pwm for _, pwm in outputs))


def turns_both_ways(function: int, reversible_flags: int) -> bool:
    """Whether an output of this function carries a motor that has its bit (CA_R_REV) in the flags."""
    return is_motor(function) and bool(reversible_flags >> function - FIRST_MOTOR & 1)


def mirrored(
    outputs: ActuatorOutputs, functions: Sequence[int], mask: int, *, reversible_flags: int
) -> ActuatorOutputs:
    """With those outputs turned round that PWM_MAIN_REV has a bit for (MixingOutput::output_limit_calc_single).

    What stands at its disarmed value stays there; a motor that turns one way alone turns the faster the less is asked.
    """
    if not mask:
        return outputs
    controls, pwm = list(outputs.controls), list(outputs.pwm)
    for place, function in enumerate(functions[: len(pwm)]):
        if mask >> place & 1 and pwm[place] != PWM_DISARMED:
            pwm[place] = 2 * CENTRED_PWM - pwm[place]
            one_way = is_motor(function) and not turns_both_ways(function, reversible_flags)
            controls[place] = 1.0 - controls[place] if one_way else -controls[place]
    return outputs._replace(controls=tuple(controls), pwm=tuple(pwm))


def _at(values: Sequence[float], number: int) -> float:
    """NaN for what was not told."""
    return values[number] if number < len(values) else math.nan
