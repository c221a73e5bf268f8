"""Slowly wandering offset between a sensor and the filter: one state, its variance, and a watch for jumps.

PX4's EKF2 (EKF/bias_estimator, v1.18). Each sample is gated; when innovations lie on one side for too long, the process
noise is boosted until the offset has been taken over.
"""

import math
from typing import Final, NamedTuple

GATE: Final = 3.0
VARIANCE_MIN: Final = 1e-8
POSITION_VARIANCE: Final = 0.1
"""With which PositionBiasEstimator's begin, m²; those of heights begin with 0 (bias_estimator.hpp)."""
MONITORING_S: Final = 10.0
BOOST: Final = 1e3
OFFSET_RATIO: Final = 0.2
LEAST_NOISE: Final = 0.01


class BiasStatus(NamedTuple):
    """What uORB estimator_bias tells."""

    bias: float = 0.0
    bias_var: float = 0.0
    innov: float = 0.0
    innov_var: float = 0.0
    innov_test_ratio: float = math.inf


class BiasEstimator:
    """`bias` and `variance`; `active`: the sensor aids, and another one is the reference."""

    def __init__(self, variance: float = 0.0) -> None:
        """`variance`: until it is reset for the first time."""
        self.bias, self.variance = 0.0, variance
        self._variance_max = 2.0
        self._ratio = self._since_positive_s = self._since_negative_s = 0.0
        self.status = BiasStatus()

    def reset(self) -> None:
        """Nothing is known: no offset."""
        self.bias = self.variance = 0.0
        self._ratio = self._since_positive_s = self._since_negative_s = 0.0

    def predict(self, noise_density: float, dt_s: float) -> None:
        """Let the variance grow by `noise_density` (unit/s/√Hz) squared over `dt_s`."""
        growth = noise_density * noise_density * dt_s
        if (
            abs(self._ratio) > OFFSET_RATIO
            or self._since_positive_s > MONITORING_S
            or self._since_negative_s > MONITORING_S
        ):
            growth *= BOOST
        self.variance = min(max(self.variance + growth, VARIANCE_MIN), self._variance_max)

    def fuse(self, measured: float, variance: float, noise_max: float, dt_s: float) -> None:
        """One sample of sensor minus filter. `noise_max`: the bias is never more uncertain than that (1 sigma)."""
        self._variance_max = max(LEAST_NOISE**2, noise_max * noise_max)
        innovation_variance = self.variance + max(LEAST_NOISE**2, variance)
        innovation = measured - self.bias
        ratio = innovation * innovation / (GATE * GATE * innovation_variance)
        if ratio < 1.0:
            gain = self.variance / innovation_variance
            self.bias += gain * innovation
            self.variance = min(max(self.variance * (1.0 - gain), VARIANCE_MIN), self._variance_max)
        signed = math.copysign(min(ratio, 1.0), innovation)
        self._ratio += dt_s / (dt_s + MONITORING_S) * (signed - self._ratio)
        if innovation > 0.0:
            self._since_positive_s = 0.0
            self._since_negative_s += dt_s
        else:
            self._since_negative_s = 0.0
            self._since_positive_s += dt_s
        self.status = BiasStatus(self.bias, self.variance, innovation, innovation_variance, ratio)
