"""ORBIT_EXECUTION_STATUS: the circle that is flown (PX4: streams/ORBIT_EXECUTION_STATUS.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_ORBIT_EXECUTION_STATUS


def stamp(now_us: int, context: Context) -> int:
    """Once per status of the mode."""
    return context.topics.orbit_status.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before an orbit was flown; a negative radius turns left."""
    orbit = context.topics.orbit_status
    if not orbit.timestamp or not math.isfinite(orbit.lat):
        return None
    return (
        orbit.timestamp,
        orbit.radius,
        truncated(orbit.lat * 1e7),
        truncated(orbit.lon * 1e7),
        orbit.alt,
        orbit.frame,
    )
