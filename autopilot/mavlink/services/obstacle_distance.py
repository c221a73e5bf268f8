"""OBSTACLE_DISTANCE and DISTANCE_SENSOR: what a companion sees around and below, for collision prevention and height.

https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE. As PX4: a sensor that looks down is a height above ground
(EKF2_RNG_CTRL), one that looks sideways and the distances around are for CP_DIST; all that a link tells is one sensor.
What a sideways one tells outside its range stays as it is: collision prevention takes no notice of its signal quality.
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.device_id import DISTANCE, device_id
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.sensors.distance_sensors import DOWNWARD
from sitl_emu.autopilot.topics import NAN, DistanceSensorSample, Topics, with_instance
from sitl_emu.autopilot.topics import ObstacleDistance as ObstacleDistanceSample
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import product

UNKNOWN_SIGNAL_QUALITY, INVALID_SIGNAL_QUALITY = 0, 1


class ObstacleDistance:
    """Writer of obstacle_distance and distance_sensors_outside."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset(
        {mavlink.MAVLINK_MSG_ID_OBSTACLE_DISTANCE, mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR}
    )
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep what it says, stamped with our time."""
        if message.get_msgId() == mavlink.MAVLINK_MSG_ID_OBSTACLE_DISTANCE:
            self._topics.obstacle_distance = obstacles(now_us, message)
            return
        identity = device_id(DISTANCE, message.get_srcSystem(), link)
        sample = distance(now_us, message)._replace(publisher=link.name, device_id=identity)
        self._topics.distance_sensors_outside = with_instance(self._topics.distance_sensors_outside, sample)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""


def obstacles(now_us: int, message: Any) -> ObstacleDistanceSample:
    """increment_f goes before increment; what is not finite is 0."""
    increment = message.increment_f if message.increment_f > 0.0 else float(message.increment)
    offset = message.angle_offset if math.isfinite(message.angle_offset) else 0.0
    return ObstacleDistanceSample(
        now_us,
        message.frame,
        tuple(message.distances),
        increment if math.isfinite(increment) else 0.0,
        message.min_distance,
        message.max_distance,
        offset,
        sensor_type=message.sensor_type,
    )


def distance(now_us: int, message: Any) -> DistanceSensorSample:
    """NaN where a sensor that looks down sees nothing within its range."""
    nearest, farthest, quality = message.min_distance, message.max_distance, message.signal_quality
    good = nearest <= message.current_distance <= farthest and quality != INVALID_SIGNAL_QUALITY
    fov = message.horizontal_fov if math.isfinite(message.horizontal_fov) else 0.0
    told_m = product(message.current_distance, 1e-2)
    return DistanceSensorSample(
        now_us,
        told_m if good or message.orientation != DOWNWARD else NAN,
        product(nearest, 1e-2),
        product(farthest, 1e-2),
        message.orientation,
        max(0.0, min(2.0 * math.pi, fov)),
        -1 if quality == UNKNOWN_SIGNAL_QUALITY else 100 * (quality - 1) // 99,
        told_m,
        message.type,
        product(message.covariance, 1e-4),
        message.vertical_fov,
        tuple(message.quaternion),
    )
