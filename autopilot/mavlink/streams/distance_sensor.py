"""DISTANCE_SENSOR: the downward lidar, and what others measure for us (PX4: streams/DISTANCE_SENSOR.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from autopilot.topics import DistanceSensorSample
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR
LASER = 0
COVARIANCE_UNKNOWN = 255
SIGNAL_UNKNOWN = 0


SILENT_US = 1_000_000
"""A sensor of others that has said nothing for so long is not told any more."""


def fields(now_us: int, context: Context) -> list[Fields]:
    """One message a sensor, numbered as uORB's instances: our own first."""
    topics = context.topics
    own = topics.distance_sensor
    samples = [own] if own.timestamp else []
    others = (topics.distance_sensor_outside, topics.distance_sensor_sideways)
    samples += [sample for sample in others if sample.timestamp and now_us - sample.timestamp < SILENT_US]
    return [_message(number, sample) for number, sample in enumerate(samples)]


def _message(number: int, sample: DistanceSensorSample) -> Fields:
    """cm; beyond the range the maximum plus one."""
    maximum_cm = round(sample.max_distance * 100.0)
    distance_m = sample.current_distance
    current_cm = min(round(distance_m * 100.0), 65535) if distance_m == distance_m else maximum_cm + 1
    return (
        sample.timestamp // 1000,
        round(sample.min_distance * 100.0),
        maximum_cm,
        current_cm,
        LASER,
        number,
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
