"""SERVO_OUTPUT_RAW: outputs 1 to 16 as the mixer gives them (PX4: streams/SERVO_OUTPUT_RAW.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW
CHANNELS: Final = 16


def fields(now_us: int, context: Context) -> Fields | None:
    """Microseconds; an output without function is 0."""
    outputs = context.actuator_outputs()
    if outputs is None:
        return None
    pwm = outputs.pwm
    pwm = pwm[:CHANNELS] + (0,) * (CHANNELS - len(pwm))
    return (outputs.timestamp & 0xFFFFFFFF, *pwm[:8], 0, *pwm[8:])
