"""TIME_ESTIMATE_TO_TARGET: seconds until the vehicle could be home (PX4: streams/TIME_ESTIMATE_TO_TARGET.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_TIME_ESTIMATE_TO_TARGET
UNSUPPORTED: Final = -1


def stamp(now_us: int, context: Context) -> int:
    """Once per estimate."""
    return context.topics.rtl_time_estimate.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """A safe return, 0 when there can be none; PX4 knows no other estimate (-1)."""
    estimate = context.topics.rtl_time_estimate
    if not estimate.timestamp:
        return None
    return (truncated(estimate.safe_time_estimate), *(UNSUPPORTED,) * 4)
