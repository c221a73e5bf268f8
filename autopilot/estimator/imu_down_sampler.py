"""IMU samples added up to the filter's step (EKF2_PREDICT_US).

PX4's EKF2 (EKF/imu_down_sampler, v1.18): rotations are multiplied, velocity changes are kept in the frame of the newest
sample. How many samples make a step follows from their mean interval, so that a step is a whole number of samples: two
of 4 ms for the 10 ms of EKF2_PREDICT_US, as the mean comes down to 4 ms from above.
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator.samples import ImuSample

INTERVAL_AT_START_S: Final = 0.005
MEAN_WEIGHT: Final = 0.1
LEAST_TARGET_S: Final = 1e-3
MOST_TARGET_S: Final = 0.1


class ImuDownSampler:
    """Gathers samples; every so many of them make one."""

    def __init__(self, target_us: float) -> None:
        self.target_us = target_us
        """EKF2_PREDICT_US."""
        self._interval_s = INTERVAL_AT_START_S
        self._restart()

    def _restart(self) -> None:
        target_s = min(max(self.target_us * 1e-6, LEAST_TARGET_S), MOST_TARGET_S)
        # The mean ends a rounding error above or below the interval: half a sample more or less must not hang on that.
        self._required = max(math.floor(target_s / self._interval_s + 0.5 - 1e-6), 1)
        self._count = 0
        self._dt_s = 0.0
        self._w, self._x, self._y, self._z = 1.0, 0.0, 0.0, 0.0
        self._vx = self._vy = self._vz = 0.0

    def update(self, time_us: int, ax: float, ay: float, az: float, vx: float, vy: float, vz: float, dt: float) -> bool:
        """Add a rotation (rad) and a change of velocity (m/s) over `dt` (s). True: `take` has a sample."""
        self._interval_s += MEAN_WEIGHT * (dt - self._interval_s)
        self._time_us = time_us
        # Rotation to the newest frame: small angles, as a sample spans a few milliseconds.
        hx, hy, hz = 0.5 * ax, 0.5 * ay, 0.5 * az
        w, x, y, z = self._w, self._x, self._y, self._z
        self._w = w - x * hx - y * hy - z * hz
        self._x = x + w * hx + y * hz - z * hy
        self._y = y + w * hy + z * hx - x * hz
        self._z = z + w * hz + x * hy - y * hx
        # What was gathered turns into the newest frame; the new change lies half way between the two.
        ox, oy, oz = self._vx + 0.5 * vx, self._vy + 0.5 * vy, self._vz + 0.5 * vz
        self._vx = ox + oy * az - oz * ay + 0.5 * vx
        self._vy = oy + oz * ax - ox * az + 0.5 * vy
        self._vz = oz + ox * ay - oy * ax + 0.5 * vz
        self._dt_s += dt
        self._count += 1
        return self._count >= self._required

    def take(self) -> ImuSample:
        """The gathered sample; the next one begins."""
        sign = -2.0 if self._w < 0.0 else 2.0
        angle = (sign * self._x, sign * self._y, sign * self._z)
        sample = ImuSample(self._time_us, angle, (self._vx, self._vy, self._vz), self._dt_s)
        self._restart()
        return sample
