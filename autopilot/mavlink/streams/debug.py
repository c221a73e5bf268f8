"""DEBUG: a number that somebody sent with its index (PX4: streams/DEBUG.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_DEBUG


def stamp(now_us: int, context: Context) -> int:
    """Once per value."""
    return context.topics.debug_value.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before anybody has sent one."""
    debug = context.topics.debug_value
    return (debug.timestamp // 1000, debug.value, debug.ind) if debug.timestamp else None
