"""OPEN_DRONE_ID_SYSTEM: the operator's place, which is home (PX4: streams/OPEN_DRONE_ID_SYSTEM.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_SYSTEM
UNKNOWN_ALTITUDE: Final = -1000.0
UNKNOWN_TIME: Final = 0
"""PX4's simulated receiver knows no date (SensorGpsSim::Run: time_utc_usec 0)."""
FIX_3D: Final = 3


def stamp(now_us: int, context: Context) -> int:
    """Once per fix."""
    return context.topics.sensor_gps.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """1e-7 deg, m; one aircraft; broadcast (targets 0). Nothing without a home or a fix in three dimensions."""
    home, gps = context.topics.home_position, context.topics.sensor_gps
    if not home.valid or gps.fix_type < FIX_3D:
        return None
    latitude, longitude, altitude_m = truncated(home.lat * 1e7), truncated(home.lon * 1e7), home.alt
    ceiling_m = floor_m = UNKNOWN_ALTITUDE
    return (latitude, longitude, ceiling_m, floor_m, altitude_m, UNKNOWN_TIME, 1, 0, 0, 0, *(0,) * 20, 0, 0, 0, 0)
