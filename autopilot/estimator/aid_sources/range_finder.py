"""Is what the range finder says the distance to the ground? Checks of the sensor before its samples are fused.

PX4's EKF2 (EKF/aid_sources/range_finder: sensor_range_finder.cpp, range_finder_consistency_check.cpp, v1.18): quality,
tilt, range, a value that is stuck, fog or dirt on the lens, and whether the distance changes as the vehicle climbs.
"""

import math
from collections import deque
from typing import Final

from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.samples import RangeSample

MAX_INTERVAL_US: Final = 200_000
LARGEST_TILT_COS: Final = 0.7071
LARGEST_MEAN_AGE_US: Final = 2e6
AGE_WEIGHT_PER_S: Final = 0.5 * 0.01 / 0.008
"""Low-pass of the samples' age, of two seconds; PX4 takes each of its steps, of 8 ms, for one of 10 ms."""
INVALID_FOR_US: Final = 10_000_000
STUCK_BELOW_M: Final = 0.1
FOG_FACTOR: Final = 2.0
MEDIAN_OF: Final = 5
CONSISTENCY_S: Final = 2.0
LEAST_CLIMB_M_S: Final = 0.5
CONSISTENT_AFTER_US: Final = 1_000_000


class RangeFinder:
    """`distance_m` along the vertical; `healthy`: the last sample passed; `regular`: samples keep coming."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.sample = RangeSample(0, 0.0, 0)
        self.limits_m = (0.0, 0.0)
        self.cos_tilt = 1.0
        self.healthy = self.regular = False
        self._age_us = 0.0
        self._looked_us = 0
        self._bad_quality_us = self._valid_us = 0
        self._stuck = self._blocked = False
        self._stuck_min_m = self._stuck_max_m = 0.0
        self._recent: deque[float] = deque(maxlen=MEDIAN_OF)
        self._median_m = 0.0
        self.consistency = Consistency()

    @property
    def distance_m(self) -> float:
        """To the ground below, along the vertical."""
        return self.sample.rng * self.cos_tilt

    def look(self, sample: RangeSample | None) -> None:
        """One step of the filter, with a sample or without."""
        ekf, value = self._ekf, self._ekf.settings
        if sample is not None:
            self.sample = sample
        pitch, r = value["EKF2_RNG_PITCH"], ekf.state.rotation
        self.cos_tilt = r[8] * math.cos(pitch) + r[6] * math.sin(pitch)
        age_us = ekf.time_us - self.sample.time_us
        weight = min(AGE_WEIGHT_PER_S * (ekf.time_us - self._looked_us) * 1e-6, 1.0) if self._looked_us else 0.0
        self._looked_us = ekf.time_us
        self._age_us = min(self._age_us + weight * (age_us - self._age_us), 2.0 * LARGEST_MEAN_AGE_US)
        self.regular = age_us <= 2 * MAX_INTERVAL_US and self._age_us < LARGEST_MEAN_AGE_US
        if not self.regular:
            self.healthy = False
        elif sample is not None:
            self.healthy = self._check(sample)

    def _check(self, sample: RangeSample) -> bool:
        ekf, value = self._ekf, self._ekf.settings
        if sample.quality == 0:
            self._bad_quality_us = ekf.time_us
        if not ekf.time_us - self._bad_quality_us > value["EKF2_RNG_QLTY_T"] * 1e6:
            return False
        nearest, farthest = self.limits_m
        if not self.cos_tilt > LARGEST_TILT_COS or not nearest <= sample.rng <= farthest:
            return False
        self._check_stuck(sample)
        self._check_fog(value["EKF2_RNG_FOG"])
        if self._stuck or self._blocked:
            return False
        self._valid_us = sample.time_us
        return True

    def _check_stuck(self, sample: RangeSample) -> None:
        """After ten seconds without a valid sample the values have to vary."""
        if sample.time_us - self._valid_us <= INVALID_FOR_US:
            return
        if self._stuck_max_m - self._stuck_min_m > STUCK_BELOW_M:
            self._stuck_min_m = self._stuck_max_m = 0.0
            self._stuck = False
            return
        self._stuck_max_m = max(self._stuck_max_m, sample.rng)
        if self._stuck_min_m < STUCK_BELOW_M or sample.rng < self._stuck_min_m:
            self._stuck_min_m = sample.rng
        self._stuck = True

    def _check_fog(self, fog_m: float) -> None:
        """The median of five drops to what a blocked sensor measures (EKF2_RNG_FOG)."""
        if fog_m <= 0.0:
            return
        self._recent.append(self.distance_m)
        median_m = sorted(self._recent)[len(self._recent) // 2]
        if not self._blocked and median_m < fog_m and self._median_m - median_m > FOG_FACTOR * fog_m:
            self._blocked = True
        elif self._blocked and median_m > FOG_FACTOR * fog_m:
            self._blocked = False
        self._median_m = median_m


class Consistency:
    """Does the distance change as the vertical velocity says? `innovation`, its variance, the signed test ratio."""

    def __init__(self) -> None:
        self.consistent = True
        self.innovation = self.innovation_variance = self.test_ratio_filtered = 0.0
        self._updated_us = self._inconsistent_us = self._motion_us = 0
        self._distance_m = 0.0

    def update(
        self, time_us: int, distance: tuple[float, float], climb: tuple[float, float], gate: float, *, moving: bool
    ) -> None:
        """A distance (m) and a velocity down (m/s), each with its variance; `moving`: horizontally."""
        if moving:
            self._motion_us = time_us
        (distance_m, variance), (vd, vd_variance) = distance, climb
        dt_s = (time_us - self._updated_us) * 1e-6
        first = not self._updated_us or not 1e-3 <= dt_s <= 0.5
        rate = (distance_m - self._distance_m) / dt_s if not first else 0.0
        self._updated_us, self._distance_m = time_us, distance_m
        if first:
            return
        self.innovation = -rate - vd
        self.innovation_variance = 2.0 * variance / (dt_s * dt_s) + vd_variance
        ratio = self.innovation**2 / (self.innovation_variance * max(gate, 1e-3) ** 2)
        weight = dt_s / (dt_s + CONSISTENCY_S)
        self.test_ratio_filtered += weight * (math.copysign(ratio, self.innovation) - self.test_ratio_filtered)
        if abs(self.test_ratio_filtered) >= 1.0:
            if time_us - self._motion_us > CONSISTENCY_S * 1e6:
                self.consistent, self._inconsistent_us = False, time_us
        elif abs(vd) > LEAST_CLIMB_M_S and ratio < 1.0 and time_us - self._inconsistent_us > CONSISTENT_AFTER_US:
            self.consistent = True
