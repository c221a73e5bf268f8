"""ACTUATOR_OUTPUT_STATUS: outputs 1 to 16 as the mixer gives them (PX4: streams/ACTUATOR_OUTPUT_STATUS.hpp)."""

from typing import Final

from sitl_emu.autopilot.control.mixer import OUTPUTS, all_pulses
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields, servo_output_raw
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS
PLACES: Final = 32
stamp = servo_output_raw.stamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Microseconds. PX4 says how many outputs there are where the message means a mask."""
    outputs = context.actuator_outputs()
    if outputs is None:
        return None
    return (outputs.timestamp, OUTPUTS, *all_pulses(outputs), *(0.0,) * (PLACES - OUTPUTS))
