"""Height from the barometer: the reference, or beside one with its offset estimated (EKF2_HGT_REF).

PX4's EKF2, aid_sources/barometer/baro_height_control.cpp (v1.18).
"""

import math

from autopilot.estimator import covariance as cov
from autopilot.estimator.filter import HEIGHT_RATIO, SENSOR_TIMEOUT_US, Filter
from autopilot.estimator.height_bias import HeightBias
from autopilot.topics import NAN, Topics

FUSION_SOURCE = 4


class BarometerAid:
    """`fused`: the last sample was, not long ago."""

    def __init__(self, topics: Topics, kalman: Filter) -> None:
        self._topics, self._filter = topics, kalman
        self._bias = HeightBias()
        self._reference_m = NAN
        self._sample_us = 0
        self.fused = False
        kalman.height_followers.append(self._follow)

    def begin(self) -> None:
        """The filter starts: heights count from the present sample."""
        baro = self._topics.sensor_baro
        self._reference_m, self._sample_us = baro.baro_alt_m, baro.timestamp

    def update(self, now_us: int, *, other_reference: bool) -> None:
        """Fuse what is new; `other_reference`: somebody else gives the height at present."""
        baro, kalman = self._topics.sensor_baro, self._filter
        settings = kalman.settings
        if baro.timestamp == self._sample_us:
            self.fused = self.fused and now_us - self._sample_us < SENSOR_TIMEOUT_US
            return
        dt_s = min((now_us - self._sample_us) * 1e-6, 1.0)
        self._sample_us = baro.timestamp
        wanted = int(settings["EKF2_BARO_CTRL"]) and FUSION_SOURCE not in kalman.disabled
        if not wanted or not math.isfinite(baro.baro_alt_m):
            self.fused = False
            return
        height, variance = baro.baro_alt_m - self._reference_m, settings["EKF2_BARO_NOISE"] ** 2
        index, down_m = cov.POSITION + 2, kalman.state.pd
        if other_reference:
            self._bias.update(height + down_m, variance + kalman.variance(index), dt_s)
        innovation = self._bias.bias_m - height - down_m
        slot = None if other_reference else HEIGHT_RATIO
        self.fused = kalman.gated(slot, ((index, innovation, variance),), settings["EKF2_BARO_GATE"], "baro_vpos")
        if self.fused:
            kalman.height_aid_us = now_us
            if not other_reference:
                kalman.height_good_us = now_us

    def _follow(self, shift_m: float) -> None:
        self._bias.reset(self._bias.bias_m + shift_m)
