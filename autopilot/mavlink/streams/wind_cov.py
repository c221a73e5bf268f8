"""WIND_COV: estimated wind (PX4: streams/WIND_COV.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_WIND_COV


def stamp(now_us: int, context: Context) -> int:
    """Once per estimate: none comes while the filter estimates none."""
    return context.topics.wind.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """m/s NED, (m/s)²; the altitude is NaN where the globe is not known. Accuracies are not told (0)."""
    wind, local = context.topics.wind, context.topics.vehicle_local_position
    if wind.windspeed_north != wind.windspeed_north:
        return None
    variance = wind.variance_north + wind.variance_east
    altitude_m = local.ref_alt - local.z if local.z_valid else math.nan
    return (wind.timestamp, wind.windspeed_north, wind.windspeed_east, 0.0, variance, 0.0, altitude_m, 0.0, 0.0)
