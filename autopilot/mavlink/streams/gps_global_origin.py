"""GPS_GLOBAL_ORIGIN: where the local frame begins (PX4: streams/GPS_GLOBAL_ORIGIN.hpp)."""

import math

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN


def fields(now_us: int, context: Context) -> Fields | None:
    """1e-7 deg, mm; nothing until the filter has an origin."""
    local = context.topics.vehicle_local_position
    if not math.isfinite(local.ref_lat):
        return None
    return (round(local.ref_lat * 1e7), round(local.ref_lon * 1e7), round(local.ref_alt * 1000.0), local.ref_timestamp)
