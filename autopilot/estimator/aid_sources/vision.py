"""Poses from outside, as EKF2_EV_CTRL wants them; their position only while GPS gives none.

PX4's EKF2, aid_sources/external_vision/ev_control.cpp (v1.18); what a sample tells is `external_vision.observe`'s.
"""

import math

from autopilot.estimator import covariance as cov
from autopilot.estimator import external_vision
from autopilot.estimator.filter import (
    HEADING_RATIO,
    HEIGHT_RATIO,
    POSITION_RATIO,
    REJECTED_TIMEOUT_US,
    SENSOR_TIMEOUT_US,
    VELOCITY_RATIO,
    Filter,
)
from autopilot.estimator.height_bias import HeightBias
from autopilot.topics import Topics
from sitl_emu.core.geodesy import wrap_pi

HGT_REF_VISION = 3


class VisionAid:
    """`gives_heading`, `gives_height`: it is what they come from."""

    def __init__(self, topics: Topics, kalman: Filter) -> None:
        self._topics, self._filter = topics, kalman
        self.sample = topics.vehicle_visual_odometry
        self._updated_us = 0
        self.gives_heading = self.gives_height = False
        self._resets = 0
        self._bias = HeightBias()

    def refresh(self) -> None:
        """Take over changed parameters."""
        settings = self._filter.settings
        self._settings = external_vision.settings_of(settings)
        self._height_wanted = int(settings["EKF2_HGT_REF"]) == HGT_REF_VISION

    @property
    def fused(self) -> bool:
        """There was a sample not long ago."""
        return bool(self._updated_us)

    def update(self, now_us: int, *, gps_fused: bool) -> None:
        """Fuse a sample that is new; none for long is noticed as well."""
        if self._topics.vehicle_visual_odometry is not self.sample:
            self.sample = self._topics.vehicle_visual_odometry
            if self._settings.control:
                self._fuse(now_us, gps_fused=gps_fused)
        elif self._updated_us and now_us - self._updated_us > SENSOR_TIMEOUT_US:
            self._updated_us, self.gives_heading, self.gives_height = 0, False, False

    def _fuse(self, now_us: int, *, gps_fused: bool) -> None:
        kalman, settings = self._filter, self._settings
        seen = external_vision.observe(self.sample, kalman.state.rotation, settings)
        if seen is None:
            return
        self._updated_us = now_us
        # A correction waiting from rest, mag or baro belongs to the state before a reset.
        kalman.apply()
        jumped = self.sample.reset_counter != self._resets
        self._resets = self.sample.reset_counter
        if seen.yaw is not None:
            rotation = kalman.state.rotation
            innovation = wrap_pi(seen.yaw - math.atan2(rotation[3], rotation[0]))
            if jumped or not kalman.yaw_aligned or not (self.gives_heading or seen.north_aligned):
                kalman.reset_yaw(innovation)
            else:
                gate = kalman.settings["EKF2_HDG_GATE"]
                kalman.gated(HEADING_RATIO, ((2, innovation, seen.yaw_variance),), gate)
            self.gives_heading = True
        if not kalman.yaw_aligned:
            return
        if seen.horizontal is not None and not gps_fused:
            self._fuse_position(now_us, seen.horizontal, seen, jumped=jumped)
        if seen.velocity is not None:
            state = kalman.state
            measured = zip(seen.velocity, (state.vn, state.ve, state.vd), seen.velocity_variance, strict=True)
            observations = tuple(
                (cov.VELOCITY + axis, told - known, variance) for axis, (told, known, variance) in enumerate(measured)
            )
            if kalman.gated(VELOCITY_RATIO, observations, settings.velocity_gate, "ev_vel") and kalman.xy_started:
                kalman.horizontal_aid_us = now_us
        if seen.down is not None:
            self._fuse_height(now_us, seen.down, seen.position_variance[2], jumped=jumped)

    def _fuse_position(
        self, now_us: int, place: tuple[float, float], seen: external_vision.Observation, *, jumped: bool
    ) -> None:
        kalman = self._filter
        state = kalman.state
        variance_n, variance_e, _ = seen.position_variance
        if not jumped and kalman.xy_valid(now_us):
            position = (
                (cov.POSITION, place[0] - state.pn, variance_n),
                (cov.POSITION + 1, place[1] - state.pe, variance_e),
            )
            if kalman.gated(POSITION_RATIO, position, self._settings.position_gate, "ev_hpos"):
                kalman.horizontal_aid_us = kalman.horizontal_good_us = now_us
                return
            if now_us - kalman.horizontal_good_us <= REJECTED_TIMEOUT_US:
                return
        if seen.velocity is not None:
            kalman.reset_velocity(seen.velocity[:2], seen.velocity_variance[0])
        kalman.reset_position(place, max(variance_n, variance_e))
        kalman.horizontal_aid_us = kalman.horizontal_good_us = now_us
        kalman.counts_from_start = True
        kalman.xy_reset_counter += 1

    def _fuse_height(self, now_us: int, down_m: float, variance: float, *, jumped: bool) -> None:
        kalman, index, gate = self._filter, cov.POSITION + 2, self._settings.position_gate
        own_m = kalman.state.pd
        if self._height_wanted:
            if jumped or not self.gives_height or now_us - kalman.height_good_us > REJECTED_TIMEOUT_US:
                self.gives_height = True
                kalman.reset_height(now_us, down_m, variance)
            elif kalman.gated(HEIGHT_RATIO, ((index, down_m - own_m, variance),), gate, "ev_vpos"):
                kalman.height_aid_us = kalman.height_good_us = now_us
            return
        if jumped or not self._bias.bias_m:
            self._bias.reset(own_m - down_m)
        self._bias.update(own_m - down_m, variance + kalman.variance(index), 0.1)
        if kalman.gated(None, ((index, down_m + self._bias.bias_m - own_m, variance),), gate, "ev_vpos"):
            kalman.height_aid_us = now_us
