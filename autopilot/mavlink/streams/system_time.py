"""SYSTEM_TIME: date and time since boot (PX4: streams/SYSTEM_TIME.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_SYSTEM_TIME


def fields(now_us: int, context: Context) -> Fields:
    """The date is the date of boot plus simulated time."""
    return (context.boot_unix_us + now_us, now_us // 1000)
