"""Offset between a height sensor and the filter's height, estimated by one state.

PX4's EKF2 does the same with the height sources that are not the reference (src/modules/ekf2/EKF/bias_estimator,
height_bias_estimator.hpp, v1.18): the bias wanders at 0.13 m/√s, each sample is gated, and steps come through slowly.
"""

BIAS_NOISE_M_SQRT_S = 0.13
INITIAL_VARIANCE_M2 = 0.1


class HeightBias:
    """`bias_m`: what the sensor says more than the filter's height above its reference."""

    def __init__(self) -> None:
        self.bias_m = 0.0
        self._variance = INITIAL_VARIANCE_M2

    def reset(self, bias_m: float) -> None:
        """Start again from a known offset."""
        self.bias_m, self._variance = bias_m, INITIAL_VARIANCE_M2

    def update(self, measured_m: float, variance_m2: float, dt_s: float) -> None:
        """One sample of sensor minus filter, `dt_s` after the last one."""
        self._variance = min(self._variance + BIAS_NOISE_M_SQRT_S**2 * dt_s, INITIAL_VARIANCE_M2)
        gain = self._variance / (self._variance + variance_m2)
        self.bias_m += gain * (measured_m - self.bias_m)
        self._variance *= 1.0 - gain
