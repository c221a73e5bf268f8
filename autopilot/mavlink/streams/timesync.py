"""TIMESYNC: our clock, for the other side to answer (PX4: streams/TIMESYNC.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_TIMESYNC


def fields(now_us: int, context: Context) -> Fields:
    """tc1 0 asks everybody; ts1 is our time in ns."""
    return (0, now_us * 1000, 0, 0)
