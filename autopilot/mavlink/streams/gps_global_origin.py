"""GPS_GLOBAL_ORIGIN: where the local frame begins (PX4: streams/GPS_GLOBAL_ORIGIN.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded

ID = mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN


def stamp(now_us: int, context: Context) -> int:
    """Once per origin."""
    local = context.topics.vehicle_local_position
    if not math.isfinite(local.ref_lat):
        return 0
    return hash((local.ref_timestamp, local.ref_lat, local.ref_lon, local.ref_alt))


def requested(now_us: int, context: Context, param2: float) -> list[Fields] | None:
    """The origin, new or not."""
    origin = fields(now_us, context)
    return None if origin is None else [origin]


def fields(now_us: int, context: Context) -> Fields | None:
    """1e-7 deg, mm; nothing until the filter has an origin."""
    local = context.topics.vehicle_local_position
    if not math.isfinite(local.ref_lat):
        return None
    return (
        rounded(local.ref_lat * 1e7),
        rounded(local.ref_lon * 1e7),
        rounded(local.ref_alt * 1000.0),
        local.ref_timestamp,
    )
