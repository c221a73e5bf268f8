"""Horizontal velocity from optical flow and the height above ground.

PX4's EKF2, aid_sources/optical_flow (v1.18), fuses the flow itself; here it gives a velocity, whose noise grows with
the height.
"""

import math

from autopilot.estimator import covariance as cov
from autopilot.estimator import external_vision
from autopilot.estimator.filter import SENSOR_TIMEOUT_US, VELOCITY_RATIO, Filter
from autopilot.estimator.terrain import Terrain
from autopilot.topics import Topics

FLOW_TILT_COSINE = math.cos(math.radians(45.0))
"""A camera that is tilted more does not see the ground below."""
UINT8_MAX = 255.0


class OpticalFlowAid:
    """`sample`: the last that was looked at."""

    def __init__(self, topics: Topics, kalman: Filter, terrain: Terrain) -> None:
        self._topics, self._filter, self._terrain = topics, kalman, terrain
        self.sample = topics.vehicle_optical_flow
        self._fused_us = 0

    def fused(self, now_us: int) -> bool:
        """A good sample came not long ago."""
        return bool(self._fused_us) and now_us - self._fused_us < SENSOR_TIMEOUT_US

    def update(self, now_us: int) -> None:
        """Fuse a sample that is new."""
        if self._topics.vehicle_optical_flow is not self.sample:
            self.sample = self._topics.vehicle_optical_flow
            if int(self._filter.settings["EKF2_OF_CTRL"]):
                self._fuse(now_us)

    def _fuse(self, now_us: int) -> None:
        """Horizontal velocity from the ground's motion and its distance; noise as the quality says."""
        flow, kalman, terrain = self.sample, self._filter, self._terrain
        state, settings = kalman.state, kalman.settings
        landed = self._topics.vehicle_land_detected.landed
        least = settings["EKF2_OF_QMIN_GND"] if landed else settings["EKF2_OF_QMIN"]
        tilt_cos = state.rotation[8]
        if flow.quality < least or not kalman.yaw_aligned or tilt_cos < FLOW_TILT_COSINE or not terrain.valid(now_us):
            return
        distance_m = max(terrain.down_m - state.pd, settings["EKF2_MIN_RNG"]) / tilt_cos
        forward, right = flow.y * distance_m, -flow.x * distance_m
        if not abs(forward) + abs(right) < external_vision.FASTEST_M_S:
            return
        rotation = state.rotation
        heading = math.hypot(rotation[0], rotation[3]) or 1.0
        cosine, sine = rotation[0] / heading, rotation[3] / heading
        north, east = cosine * forward - sine * right, sine * forward + cosine * right
        share = min(max((flow.quality - least) / max(UINT8_MAX - least, 1.0), 0.0), 1.0)
        self._fused_us = now_us
        noise = settings["EKF2_OF_N_MAX"] + (settings["EKF2_OF_N_MIN"] - settings["EKF2_OF_N_MAX"]) * share
        variance = (noise * distance_m) ** 2
        kalman.apply()
        if not kalman.xy_valid(now_us):
            kalman.reset_velocity((north, east), variance)
            kalman.counts_from_start = True
            kalman.horizontal_aid_us = now_us
            kalman.xy_reset_counter += 1
            return
        velocity = ((cov.VELOCITY, north - state.vn, variance), (cov.VELOCITY + 1, east - state.ve, variance))
        if kalman.gated(VELOCITY_RATIO, velocity, settings["EKF2_OF_GATE"]):
            kalman.horizontal_aid_us = now_us
