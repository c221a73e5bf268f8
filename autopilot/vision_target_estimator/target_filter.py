"""One axis of where a target that stands is from the vehicle: PX4's KF_position (vision_target_estimator, v1.18)."""

from typing import Final

LEAST_VARIANCE: Final = 1e-9


class TargetFilter:
    """Metres from the vehicle to the target, and the vehicle's speed in m/s, along one axis of NED.

    `bias_m`: how much farther away the vehicle's receiver has the target than it is.
    """

    def __init__(
        self,
        distance_m: float,
        speed_m_s: float,
        bias_m: float,
        distance_variance: float,
        speed_variance: float,
        bias_variance: float,
    ) -> None:
        self.distance_m, self.speed_m_s, self.bias_m = distance_m, speed_m_s, bias_m
        # Covariance of distance (d), speed (s) and bias (b), by pairs.
        self._dd, self._ss, self._bb = distance_variance, speed_variance, bias_variance
        self._ds = self._db = self._sb = 0.0

    @property
    def speed_variance(self) -> float:
        """Of `speed_m_s`, m²/s²."""
        return self._ss

    def predict(self, dt_s: float, acceleration_m_s2: float, noise: float, bias_noise: float) -> None:
        """The vehicle has been accelerated for so long; `noise`, `bias_noise`: spectral densities, m²/s³ and m²/s."""
        self.distance_m -= (self.speed_m_s + 0.5 * acceleration_m_s2 * dt_s) * dt_s
        self.speed_m_s += acceleration_m_s2 * dt_s
        self._dd += (self._ss * dt_s - 2.0 * self._ds) * dt_s + dt_s**3 / 3.0 * noise
        self._ds -= self._ss * dt_s + 0.5 * dt_s * dt_s * noise
        self._db -= self._sb * dt_s
        self._ss += dt_s * noise
        self._bb += dt_s * bias_noise

    def fuse_distance(self, measured_m: float, variance: float, threshold: float, *, is_biased: bool = False) -> bool:
        """False where it is too far off: the innovation's square by its variance is above the threshold."""
        if not is_biased:
            innovation_m = measured_m - self.distance_m
            return self._fuse(innovation_m, self._dd + variance, threshold, self._dd, self._ds, self._db)
        innovation_m = measured_m - self.distance_m - self.bias_m
        d, s, b = self._dd + self._db, self._ds + self._sb, self._db + self._bb
        return self._fuse(innovation_m, d + b + variance, threshold, d, s, b)

    def fuse_speed(self, measured_m_s: float, variance: float, threshold: float) -> bool:
        """The same of the vehicle's speed."""
        innovation_m_s = measured_m_s - self.speed_m_s
        return self._fuse(innovation_m_s, self._ss + variance, threshold, self._ds, self._ss, self._sb)

    def restart(self, distance_m: float, bias_m: float, distance_variance: float, bias_variance: float) -> None:
        """Distance and bias have become known: the speed is kept, and how sure it is."""
        self.distance_m, self.bias_m = distance_m, bias_m
        self._dd, self._bb = distance_variance, bias_variance
        self._ds = self._db = self._sb = 0.0

    def _fuse(self, innovation: float, variance: float, threshold: float, d: float, s: float, b: float) -> bool:
        """`variance`: of the innovation; the others: how the states vary with what is measured."""
        if innovation * innovation > threshold * variance:
            return False
        scaled = innovation / variance
        self.distance_m += d * scaled
        self.speed_m_s += s * scaled
        self.bias_m += b * scaled
        self._dd = max(self._dd - d * d / variance, LEAST_VARIANCE)
        self._ss = max(self._ss - s * s / variance, LEAST_VARIANCE)
        self._bb = max(self._bb - b * b / variance, LEAST_VARIANCE)
        self._ds -= d * s / variance
        self._db -= d * b / variance
        self._sb -= s * b / variance
        return True
