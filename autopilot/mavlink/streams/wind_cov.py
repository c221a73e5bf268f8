"""WIND_COV: estimated wind (PX4: streams/WIND_COV.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_WIND_COV


def fields(now_us: int, context: Context) -> Fields | None:
    """m/s NED; nothing while the filter estimates none. Accuracies are not told (0)."""
    wind = context.topics.wind
    if wind.windspeed_north != wind.windspeed_north:
        return None
    altitude_m = context.topics.vehicle_global_position.alt
    return (wind.timestamp, wind.windspeed_north, wind.windspeed_east, 0.0, 0.0, 0.0, altitude_m, 0.0, 0.0)
