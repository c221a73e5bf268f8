"""DISTANCE_SENSOR: the downward lidar (PX4: streams/DISTANCE_SENSOR.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR
LASER = 0
COVARIANCE_UNKNOWN = 255
SIGNAL_UNKNOWN = 0


def fields(now_us: int, context: Context) -> Fields | None:
    """cm; beyond the range the maximum plus one."""
    sample = context.topics.distance_sensor
    if sample.timestamp == 0:
        return None
    maximum_cm = round(sample.max_distance * 100.0)
    distance_m = sample.current_distance
    current_cm = min(round(distance_m * 100.0), 65535) if distance_m == distance_m else maximum_cm + 1
    return (
        sample.timestamp // 1000,
        round(sample.min_distance * 100.0),
        maximum_cm,
        current_cm,
        LASER,
        0,
        sample.orientation,
        COVARIANCE_UNKNOWN,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        SIGNAL_UNKNOWN,
    )
