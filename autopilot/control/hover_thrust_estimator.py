"""Which thrust holds the vehicle in the air, learnt in flight.

PX4's ZeroOrderHoverThrustEkf (src/modules/mc_hover_thrust_estimator, v1.18): one state, observed through the vertical
acceleration that a thrust brings about; HTE_HT_NOISE, HTE_HT_ERR_INIT, HTE_ACC_GATE, HTE_THR_RANGE.
"""

import math

from sitl_emu.core.c_types import quotient

GRAVITY_M_S2 = 9.80665
ACCEL_VARIANCE = 5.0
"""Start of the adaptive variance of the acceleration, (m/s²)²."""
NOISE_TIME_CONSTANT_S = 1.0
RECOVERY_AFTER_S = 2.0
VALID_VARIANCE = 0.001
VALID_AFTER_S = 1.0


class HoverThrustEstimator:
    """`hover_thrust` (0..1) and whether it is `valid`."""

    def __init__(self, hover_thrust: float, error: float) -> None:
        """Start from MPC_THR_HOVER with the standard deviation HTE_HT_ERR_INIT."""
        self.hover_thrust, self._variance = hover_thrust, error * error
        self._start = hover_thrust
        self._accel_variance = ACCEL_VARIANCE
        self._residual = 0.0
        self._good_s = self._rejected_s = 0.0

    @property
    def valid(self) -> bool:
        """Whether it has settled."""
        return self._good_s >= VALID_AFTER_S

    def pause(self) -> None:
        """On the ground or moving fast: the estimate stays, but is not called valid."""
        self._good_s = 0.0

    def update(
        self, accel_up_m_s2: float, thrust: float, dt_s: float, noise: float, gate: float, thrust_range: float
    ) -> None:
        """One sample: acceleration up (without gravity) under a vertical thrust (0..1)."""
        self._variance += noise * noise * dt_s * dt_s
        hover = self.hover_thrust
        slope = -GRAVITY_M_S2 * thrust / (hover * hover)
        innovation = accel_up_m_s2 - GRAVITY_M_S2 * (thrust / hover - 1.0)
        expected = slope * slope * self._variance + self._accel_variance
        ratio = quotient(innovation * innovation, gate * gate * expected)
        if ratio <= 1.0:
            self._rejected_s = 0.0
            gain = self._variance * slope / expected
            low, high = max(0.1, self._start - thrust_range), min(0.9, self._start + thrust_range)
            self.hover_thrust = max(low, min(high, hover + gain * innovation))
            self._variance = max(1e-10, min(1.0, self._variance * (1.0 - gain * slope)))
        else:
            self._rejected_s += dt_s
            if self._rejected_s > RECOVERY_AFTER_S:
                self._variance = min(1.0, self._variance + 0.01 * dt_s)
        residual = accel_up_m_s2 - GRAVITY_M_S2 * (thrust / self.hover_thrust - 1.0)
        weight = dt_s / (NOISE_TIME_CONSTANT_S + dt_s)
        self._residual += weight * (residual - self._residual)
        spread = residual - self._residual
        slope = -GRAVITY_M_S2 * thrust / (self.hover_thrust * self.hover_thrust)
        measured = spread * spread + slope * slope * self._variance
        self._accel_variance = max(0.5, min(400.0, self._accel_variance + weight * (measured - self._accel_variance)))
        good = self._variance < VALID_VARIANCE and math.sqrt(ratio) < 1.0
        self._good_s = self._good_s + dt_s if good else 0.0
