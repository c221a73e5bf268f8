"""How much farther away a receiver has the target than a camera does, at first: a mean until it stands still.

PX4's VTEPosition (startBiasAveraging, updateBiasAveraging; vision_target_estimator, v1.18).
"""

import math
from typing import Final

from sitl_emu.autopilot.topics import Vector3

TIME_CONSTANT_S: Final = 0.3
LEAST_US: Final = 600_000
"""Twice that (kInitialBiasLpfMinTimeFactor)."""
STABLE_SAMPLES: Final = 5


class BiasAverage:
    """A low-pass that began with a first difference, in m along NED."""

    def __init__(self, time_us: int, bias: Vector3) -> None:
        self.bias = bias
        self._began_us = self._last_us = time_us
        self._stable = 0

    def is_done(self, time_us: int, bias: Vector3, threshold_m: float, timeout_us: float) -> bool:
        """Take a difference: five in a row within `threshold_m` of the mean are enough, or so much time."""
        if time_us <= self._last_us:
            return False
        self._stable = self._stable + 1 if math.dist(bias, self.bias) <= threshold_m else 0
        dt_s, self._last_us = (time_us - self._last_us) * 1e-6, time_us
        weight = dt_s / (dt_s + TIME_CONSTANT_S)
        x, y, z = (old + weight * (new - old) for old, new in zip(self.bias, bias, strict=True))
        self.bias = (x, y, z)
        age_us = time_us - self._began_us
        return (self._stable >= STABLE_SAMPLES and age_us >= LEAST_US) or age_us >= timeout_us
