"""Whether a sensor's bias has been learnt so well that the sensor may be calibrated by it.

PX4's EKF2 (EKF2.cpp, UpdateCalibration and InFlightCalibration, v1.18): its variances have to be small and alike, and
it must not have moved by more than a tenth of its limit for ten seconds of learning.
"""

import math
from typing import Final

from sitl_emu.autopilot.topics import Vector3

LARGEST_VARIANCE: Final = 1e-3
LARGEST_RATIO: Final = 1e2
LARGEST_CHANGE: Final = 0.1
"""Share of the bias's limit."""
LEARNING_US: Final = 10_000_000


class StableBias:
    """`stable`, since `update` was told so for long enough; `restart` at every take-off."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget what was learnt."""
        self.stable = False
        self._bias: Vector3 = (0.0, 0.0, 0.0)
        self._last_us = self._total_us = 0

    def update(
        self, now_us: int, bias: Vector3, variances: Vector3, limit: float, *, valid: bool, learning: bool
    ) -> None:
        """`valid`: the filter works as it should; `learning`: it estimates this bias just now."""
        largest = max(variances)
        valid = valid and largest < LARGEST_VARIANCE and largest < LARGEST_RATIO * min(variances)
        if not valid or not learning:
            self._last_us = 0
            if not valid and self._total_us:
                self.restart()
            return
        if math.dist(bias, self._bias) > LARGEST_CHANGE * limit:
            self._bias, self._total_us, self.stable = bias, 0, False
        else:
            self._total_us += now_us - self._last_us if self._last_us else 0
            self.stable = self.stable or self._total_us > LEARNING_US
        self._last_us = now_us
