"""DEBUG_FLOAT_ARRAY: numbers that somebody sent with their name (PX4: streams/DEBUG_FLOAT_ARRAY.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY


def stamp(now_us: int, context: Context) -> int:
    """Once per value."""
    return context.topics.debug_array.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before anybody has sent one."""
    debug = context.topics.debug_array
    return (debug.timestamp, debug.id, debug.name, *debug.data) if debug.timestamp else None
