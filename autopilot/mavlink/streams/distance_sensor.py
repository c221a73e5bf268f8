"""DISTANCE_SENSOR: the downward lidar, and what others measure for us (PX4: streams/DISTANCE_SENSOR.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.topics import DistanceSensorSample
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded

ID = mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR
LASER: Final = 0
COVARIANCE_CM2: Final = 0
"""A simulated sensor states no variance."""
SIGNAL_UNKNOWN: Final = 0
SIGNAL_INVALID: Final = 1
SILENT_US: Final = 1_000_000
"""A sensor that has said nothing for so long is not told any more."""


def stamp(now_us: int, context: Context) -> int:
    """Once per measurement, whose ever."""
    topics = context.topics
    sensors = (topics.distance_sensor, topics.distance_sensor_outside, topics.distance_sensor_sideways)
    return max(sensor.timestamp for sensor in sensors)


def fields(now_us: int, context: Context) -> list[Fields]:
    """One message a sensor, numbered as uORB's instances: our own first."""
    topics = context.topics
    sensors = (topics.distance_sensor, topics.distance_sensor_outside, topics.distance_sensor_sideways)
    known = [sensor for sensor in sensors if sensor.timestamp]
    return [_message(number, sensor) for number, sensor in enumerate(known) if now_us - sensor.timestamp < SILENT_US]


def _message(number: int, sample: DistanceSensorSample) -> Fields:
    """cm, percent; out of range the maximum plus one, as the simulator says, with an invalid signal."""
    maximum_cm = rounded(sample.max_distance * 100.0)
    in_range = sample.current_distance == sample.current_distance
    quality = sample.signal_quality if in_range else 0
    current_cm = min(rounded(sample.current_distance * 100.0), 65535) if in_range else maximum_cm + 1
    return (
        sample.timestamp // 1000,
        rounded(sample.min_distance * 100.0),
        maximum_cm,
        current_cm,
        LASER,
        number,
        sample.orientation,
        COVARIANCE_CM2,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        SIGNAL_UNKNOWN if quality < 0 else max(quality, SIGNAL_INVALID),
    )
