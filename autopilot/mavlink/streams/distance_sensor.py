"""DISTANCE_SENSOR: the downward lidar, and what others measure for us (PX4: streams/DISTANCE_SENSOR.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields, new_ones
from sitl_emu.autopilot.sensors.distance_sensors import distance_sensors
from sitl_emu.autopilot.topics import DistanceSensorSample
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import product, truncated

ID = mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR
LASER: Final = 0
ULTRASOUND: Final = 1
INFRARED: Final = 2
"""MAV_DISTANCE_SENSOR; whatever else a sensor is, it is told as a laser."""
SIGNAL_UNKNOWN: Final = 0
SIGNAL_INVALID: Final = 1


def since(context: Context, told: tuple[int, ...] | int) -> tuple[tuple[int, ...], list[Fields]]:
    """Every sensor that has measured since then, numbered as uORB's instances: our own first."""
    sensors = [sensor for sensor in distance_sensors(context.topics) if sensor.timestamp]
    stamps = tuple(sensor.timestamp for sensor in sensors)
    return stamps, [_message(number, sensors[number]) for number in new_ones(stamps, told)]


def fields(now_us: int, context: Context) -> Fields | None:
    """Distances are told as they are measured."""
    return None


def _message(instance: int, sample: DistanceSensorSample) -> Fields:
    """cm, percent; our own tells the maximum plus one out of range, as the simulator says, with an invalid signal."""
    maximum_cm = _cm(sample.max_distance)
    distance, quality = sample.told_distance, sample.signal_quality
    if distance != distance:
        distance = sample.current_distance
    current_cm = _cm(distance)
    if distance != distance:
        current_cm, quality = maximum_cm + 1, 0
    return (
        sample.timestamp // 1000,
        _cm(sample.min_distance),
        maximum_cm,
        current_cm,
        sample.type if sample.type in (ULTRASOUND, INFRARED) else LASER,
        instance,
        sample.orientation,
        truncated(product(sample.variance, 1e4)),
        sample.h_fov,
        sample.v_fov,
        *sample.q,
        SIGNAL_UNKNOWN if quality < 0 else max(quality, SIGNAL_INVALID),
    )


def _cm(metres: float) -> int:
    """Without the fraction, which float32 may leave just below the next centimetre."""
    return truncated(product(metres, 100.0))
