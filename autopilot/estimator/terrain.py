"""Height of the ground below the vehicle, from a downward distance sensor.

One state, the terrain's position down in the local frame, as in PX4's EKF2 (terrain_control.cpp, v1.18; EKF2_RNG_NOISE,
EKF2_RNG_SFE, EKF2_RNG_GATE, EKF2_TERR_NOISE, EKF2_TERR_GRAD). It never corrects the vehicle's own height
(EKF2_RNG_CTRL's conditional height aiding is left out).
"""

import math

from autopilot.topics import NAN

LARGEST_TILT_COS = 0.7071
"""PX4's range_cos_max_tilt: beyond 45 degrees the beam says nothing about the height."""
VALID_FOR_US = 1_000_000


class Terrain:
    """`down_m`: position of the ground below, NaN before the first good sample."""

    def __init__(self) -> None:
        self.down_m = NAN
        self._variance = 0.0
        self._updated_us = 0

    def valid(self, now_us: int) -> bool:
        """Whether a sample was fused within the last second."""
        return math.isfinite(self.down_m) and now_us - self._updated_us < VALID_FOR_US

    def shift(self, delta_m: float) -> None:
        """The vehicle's own height was reset by `delta_m` down: so is the ground's."""
        self.down_m += delta_m

    def update(
        self,
        now_us: int,
        distance_m: float,
        tilt_cos: float,
        vehicle_down_m: float,
        speed_m_s: float,
        noise: tuple[float, float, float, float, float],
    ) -> None:
        """Fuse one range; `noise`: EKF2_RNG_NOISE, _RNG_SFE, _RNG_GATE, _TERR_NOISE, _TERR_GRAD. NaN is no sample."""
        if not math.isfinite(distance_m) or tilt_cos < LARGEST_TILT_COS:
            return
        range_noise, range_scale, gate, process_noise, gradient = noise
        measured_m = vehicle_down_m + distance_m * tilt_cos
        variance = range_noise**2 + (range_scale * distance_m) ** 2
        if not self.valid(now_us):
            self.down_m, self._variance, self._updated_us = measured_m, variance, now_us
            return
        dt_s = (now_us - self._updated_us) * 1e-6
        predicted = self._variance + (process_noise * dt_s) ** 2 + (gradient * speed_m_s * dt_s) ** 2
        innovation = measured_m - self.down_m
        if innovation * innovation > gate * gate * (predicted + variance):
            return
        gain = predicted / (predicted + variance)
        self.down_m += gain * innovation
        self._variance, self._updated_us = predicted * (1.0 - gain), now_us
