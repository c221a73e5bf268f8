"""One axis of where a target that stands is from the vehicle: PX4's KF_position (vision_target_estimator, v1.18).

Its third state, how far the receivers disagree with what a camera sees, is left out with the camera.
"""

from typing import Final

LEAST_VARIANCE: Final = 1e-9


class TargetFilter:
    """Metres from the vehicle to the target, and the vehicle's speed in m/s, along one axis of NED."""

    def __init__(self, distance_m: float, speed_m_s: float, distance_variance: float, speed_variance: float) -> None:
        self.distance_m, self.speed_m_s = distance_m, speed_m_s
        self._distance, self._both, self._speed = distance_variance, 0.0, speed_variance

    def predict(self, dt_s: float, acceleration_m_s2: float, noise: float) -> None:
        """The vehicle has been accelerated for so long; `noise`: the spectral density of that, m²/s³."""
        self.distance_m -= (self.speed_m_s + 0.5 * acceleration_m_s2 * dt_s) * dt_s
        self.speed_m_s += acceleration_m_s2 * dt_s
        self._distance += (self._speed * dt_s - 2.0 * self._both) * dt_s + dt_s**3 / 3.0 * noise
        self._both -= self._speed * dt_s + 0.5 * dt_s * dt_s * noise
        self._speed += dt_s * noise

    def fuse_distance(self, measured_m: float, variance: float, threshold: float) -> bool:
        """False where it is too far off: the innovation's square by its variance is above the threshold."""
        return self._fuse(
            measured_m - self.distance_m, self._distance + variance, threshold, self._distance, self._both
        )

    def fuse_speed(self, measured_m_s: float, variance: float, threshold: float) -> bool:
        """The same of the vehicle's speed."""
        return self._fuse(measured_m_s - self.speed_m_s, self._speed + variance, threshold, self._both, self._speed)

    def _fuse(self, innovation: float, variance: float, threshold: float, distance: float, speed: float) -> bool:
        """`variance`: of the innovation; `distance`, `speed`: how the states vary with what is measured."""
        if innovation * innovation > threshold * variance:
            return False
        gain, speed_gain = distance / variance, speed / variance
        self.distance_m += gain * innovation
        self.speed_m_s += speed_gain * innovation
        self._distance = max(self._distance - gain * distance, LEAST_VARIANCE)
        self._both -= gain * speed
        self._speed = max(self._speed - speed_gain * speed, LEAST_VARIANCE)
        return True
