"""ALTITUDE: heights in all their meanings (PX4: streams/ALTITUDE.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ALTITUDE


def fields(now_us: int, context: Context) -> Fields | None:
    """Metres; NaN for what is not known. Relative to home, or to the local origin while there is no home."""
    topics = context.topics
    local = topics.vehicle_local_position
    if local.timestamp == 0:
        return None
    monotonic_m = topics.vehicle_air_data.baro_alt_meter if topics.vehicle_air_data.timestamp else math.nan
    amsl_m = local_m = relative_m = terrain_m = clearance_m = math.nan
    if local.z_valid:
        home = topics.home_position
        amsl_m = local.ref_alt - local.z if math.isfinite(local.ref_alt) else monotonic_m
        local_m = -local.z
        relative_m = home.z - local.z if home.valid and home.valid_lpos else local_m
        if local.dist_bottom_valid:
            clearance_m = local.dist_bottom
            terrain_m = local_m - clearance_m
    return (now_us, monotonic_m, amsl_m, local_m, relative_m, terrain_m, clearance_m)
