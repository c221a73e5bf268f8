"""PX4's filters (src/lib/mathlib/math/filter, v1.18).

Body rates pass two notch filters (IMU_GYRO_NF0_*, IMU_GYRO_NF1_*) where there are any and a second-order Butterworth
low-pass (IMU_GYRO_CUTOFF), their derivative a first-order one (IMU_DGYRO_CUTOFF). Their dynamic notch filters
(IMU_GYRO_DNF*) are left out: nothing simulated vibrates.
"""

import math
from collections.abc import Sequence
from typing import Final

from sitl_emu.autopilot.topics import Vector3

FLT_EPSILON: Final = 1.19e-7
LEAST_OF_SAMPLE_RATE: Final = 0.001
"""A notch is nowhere lower, nor narrower, by the sample rate (NotchFilter::setParameters)."""


class LowPass2p:
    """Second-order Butterworth low-pass of a vector, in direct form II."""

    def __init__(self, sample_hz: float, cutoff_hz: float) -> None:
        """A cutoff of zero, or beyond half the sample rate, lets everything through."""
        self._through = cutoff_hz <= 0.0 or cutoff_hz >= sample_hz / 2
        ohm = math.tan(math.pi * cutoff_hz / sample_hz) if not self._through else 1.0
        c = 1.0 + math.sqrt(2.0) * ohm + ohm * ohm
        self._b0 = ohm * ohm / c
        self._a1 = 2.0 * (ohm * ohm - 1.0) / c
        self._a2 = (1.0 - math.sqrt(2.0) * ohm + ohm * ohm) / c
        self._x1 = self._x2 = self._y1 = self._y2 = self._z1 = self._z2 = 0.0

    def begin_at(self, x: float, y: float, z: float) -> None:
        """This vector counts as one that has always been there (LowPassFilter2p::reset)."""
        total = 1.0 + self._a1 + self._a2
        share = 1.0 / total if total > FLT_EPSILON else 1.0
        self._x1 = self._x2 = x * share
        self._y1 = self._y2 = y * share
        self._z1 = self._z2 = z * share

    def update(self, x: float, y: float, z: float) -> Vector3:
        """The filtered vector after one more sample."""
        if self._through:
            return x, y, z
        b0, a1, a2 = self._b0, self._a1, self._a2
        x1, x2, y1, y2, z1, z2 = self._x1, self._x2, self._y1, self._y2, self._z1, self._z2
        x0 = x - a1 * x1 - a2 * x2
        y0 = y - a1 * y1 - a2 * y2
        z0 = z - a1 * z1 - a2 * z2
        self._x1, self._x2, self._y1, self._y2, self._z1, self._z2 = x0, x1, y0, y1, z0, z1
        return b0 * (x0 + x1 + x1 + x2), b0 * (y0 + y1 + y1 + y2), b0 * (z0 + z1 + z1 + z2)


class NotchFilter:
    """Second-order notch, in direct form I: takes out what goes at `centre_hz` and weakens `bandwidth_hz` about it."""

    def __init__(self, sample_hz: float, centre_hz: float, bandwidth_hz: float) -> None:
        """A centre of zero, or beyond half the sample rate, lets everything through; so does a bandwidth of zero."""
        self.through = not (0.0 < centre_hz < sample_hz / 2 and 0.0 < bandwidth_hz < sample_hz / 2)
        least = LEAST_OF_SAMPLE_RATE * sample_hz
        width = math.tan(math.pi * max(bandwidth_hz, least) / sample_hz) if not self.through else 0.0
        self._b0 = 1.0 / (width + 1.0)
        self._b1 = -2.0 * math.cos(math.tau * max(centre_hz, least) / sample_hz) * self._b0
        self._a2 = (1.0 - width) * self._b0
        self._started = False
        self._x1 = self._x2 = self._y1 = self._y2 = 0.0

    def reset(self) -> None:
        """Begin anew: the next sample counts as one that has always been there."""
        self._started = False

    def update(self, x: float) -> float:
        """The filtered value after one more sample."""
        if self.through:
            return x
        if not self._started:
            self._started = True
            self._x1 = self._x2 = self._y1 = self._y2 = x if math.isfinite(x) else 0.0
        y = self._b0 * (x + self._x2) + self._b1 * (self._x1 - self._y1) - self._a2 * self._y2
        self._x1, self._x2, self._y1, self._y2 = x, self._x1, y, self._y1
        return y


class NotchedLowPass2p(LowPass2p):
    """The same behind notch filters."""

    def __init__(self, sample_hz: float, cutoff_hz: float, notches: Sequence[tuple[float, float]]) -> None:
        """`notches`: (centre_hz, bandwidth_hz) of each, as of `NotchFilter`."""
        super().__init__(sample_hz, cutoff_hz)
        self._notches = [[NotchFilter(sample_hz, *each) for each in notches] for _ in range(3)]

    def update(self, x: float, y: float, z: float) -> Vector3:
        """See LowPass2p."""
        for of_x, of_y, of_z in zip(*self._notches, strict=True):
            x, y, z = of_x.update(x), of_y.update(y), of_z.update(z)
        return super().update(x, y, z)


def alpha(cutoff_hz: float, dt_s: float) -> float:
    """Weight of a new sample in a first-order low-pass; 1 for a cutoff of zero (no filter)."""
    if cutoff_hz <= 0.0:
        return 1.0
    return dt_s / (dt_s + 1.0 / (math.tau * cutoff_hz))
