"""STORAGE_INFORMATION: the log's disk (PX4: streams/STORAGE_INFORMATION.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION
READY = 2


def fields(now_us: int, context: Context) -> Fields:
    """On request; one storage whose size is not told."""
    return (now_us // 1000, 0.0, 0.0, 0.0, 0.0, 0.0, 1, 1, READY, 0, b"", 0)
