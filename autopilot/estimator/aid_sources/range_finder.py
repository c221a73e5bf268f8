"""Height above the ground from the distance sensor: the own one, else one that tells from outside."""

import math

from autopilot.estimator.filter import Filter
from autopilot.estimator.terrain import Terrain
from autopilot.topics import Topics

FUSION_SOURCE = 5


class RangeFinderAid:
    """Feeds `terrain`."""

    def __init__(self, topics: Topics, kalman: Filter, terrain: Terrain) -> None:
        self._topics, self._filter, self._terrain = topics, kalman, terrain
        self._sample_us = 0
        kalman.height_followers.append(terrain.shift)

    def refresh(self) -> None:
        """Take over changed parameters."""
        settings = self._filter.settings
        self._noise = (
            settings["EKF2_RNG_NOISE"],
            settings["EKF2_RNG_SFE"],
            settings["EKF2_RNG_GATE"],
            settings["EKF2_TERR_NOISE"],
            settings["EKF2_TERR_GRAD"],
        )

    def update(self, now_us: int) -> None:
        """Fuse a sample that is new."""
        own, kalman = self._topics.distance_sensor, self._filter
        sample = own if own.timestamp else self._topics.distance_sensor_outside
        if sample.timestamp == self._sample_us or not int(kalman.settings["EKF2_RNG_CTRL"]):
            return
        self._sample_us = sample.timestamp
        if FUSION_SOURCE in kalman.disabled:
            return
        state = kalman.state
        speed = math.hypot(state.vn, state.ve)
        self._terrain.update(now_us, sample.current_distance, state.rotation[8], state.pd, speed, self._noise)
