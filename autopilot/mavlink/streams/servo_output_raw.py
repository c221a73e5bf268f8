"""SERVO_OUTPUT_RAW: outputs 1 to 16 as the mixer gives them (PX4: streams/SERVO_OUTPUT_RAW.hpp)."""

from sitl_emu.autopilot.control.mixer import all_pulses
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import c_types
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW


def stamp(now_us: int, context: Context) -> int:
    """Once per output: none comes where a mode allocates nothing."""
    outputs = context.actuator_outputs()
    return 0 if outputs is None else outputs.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Microseconds, without their fraction."""
    outputs = context.actuator_outputs()
    if outputs is None:
        return None
    pwm = [int(c_types.float32(pulse)) for pulse in all_pulses(outputs)]
    return (outputs.timestamp & 0xFFFFFFFF, *pwm[:8], 0, *pwm[8:])
