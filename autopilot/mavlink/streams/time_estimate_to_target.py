"""TIME_ESTIMATE_TO_TARGET: seconds until the vehicle could be home (PX4: streams/TIME_ESTIMATE_TO_TARGET.hpp)."""

import math

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_TIME_ESTIMATE_TO_TARGET
UNKNOWN = -1


def fields(now_us: int, context: Context) -> Fields:
    """A safe return at mission speed and landing; PX4 knows no other estimate either (-1)."""
    topics = context.topics
    home, local = topics.home_position, topics.vehicle_local_position
    safe_return_s = UNKNOWN
    if home.valid and local.xy_valid and not topics.vehicle_land_detected.landed:
        parameters = context.parameters
        distance_m = math.hypot(local.x - home.x, local.y - home.y)
        height_m = max(home.z - local.z, 0.0)
        cruise_s = distance_m / max(float(parameters["MPC_XY_CRUISE"]), 0.1)
        safe_return_s = round(cruise_s + height_m / max(float(parameters["MPC_LAND_SPEED"]), 0.1))
    return (safe_return_s, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN)
