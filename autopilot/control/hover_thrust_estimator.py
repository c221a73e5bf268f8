"""Which thrust holds the vehicle in the air, learnt in flight.

PX4's MulticopterHoverThrustEstimator and ZeroOrderHoverThrustEkf (src/modules/mc_hover_thrust_estimator, v1.18): one
state, observed through the vertical acceleration that a thrust brings about, with a noise of the acceleration that is
learnt too. HTE_HT_NOISE, HTE_HT_ERR_INIT, HTE_ACC_GATE, HTE_THR_RANGE, HTE_VZ_THR, HTE_VXY_THR.
"""

import math
from typing import Final, NamedTuple

from sitl_emu.autopilot.topics import HoverThrustEstimate

GRAVITY_M_S2: Final = 9.80665
ACCEL_VARIANCE: Final = 5.0
"""Start of the learnt variance of the acceleration, (m/s²)²; then it stays within the next two."""
LEAST_ACCEL_VARIANCE: Final = 1.0
MOST_ACCEL_VARIANCE: Final = 400.0
LEAST_VARIANCE: Final = 1e-10
MOST_VARIANCE: Final = 1.0
"""Of the hover thrust."""
NOISE_TIME_CONSTANT_S: Final = 2.0
LOW_PASS_TIME_CONSTANT_S: Final = 1.0
LARGE_OFFSET: Final = 0.2
"""Filtered test ratio beyond which rejected measurements mean that the hover thrust has changed."""
RECOVERY_NOISE: Final = 1e3
"""Process noise is so much larger then."""
VALID_VARIANCE: Final = 0.001
VALID_AFTER_S: Final = 2.0
TOLD_EVERY_US: Final = 40_000
SMALLEST_GATE: Final = 1e-3
SMALLEST_HOVER: Final = 1e-3
"""So that no parameter makes a division by zero."""
INVALID = HoverThrustEstimate()


class HoverThrustParameters(NamedTuple):
    """The parameters that it obeys."""

    hover: float
    """MPC_THR_HOVER."""
    error: float
    noise: float
    gate: float
    thrust_range: float
    fast_vertical_m_s: float
    fast_horizontal_m_s: float


class HoverThrustEstimator:
    """`estimate` is the present one; invalid, and all NaN, while the vehicle does not fly."""

    def __init__(self, parameters: HoverThrustParameters) -> None:
        self.estimate = INVALID
        self._parameters = parameters
        self._told_us = -TOLD_EVERY_US
        self._hover = self._variance = 0.0
        self._low = self._high = self._gate_squared = self._noise_squared = 0.0
        self._copy()
        self._reset()

    def set_parameters(self, parameters: HoverThrustParameters) -> None:
        """Obey others from now on; another HTE_HT_ERR_INIT begins with that error anew."""
        if parameters.error != self._parameters.error:
            self._variance = parameters.error * parameters.error
        self._parameters = parameters
        self._copy()

    def _copy(self) -> None:
        told = self._parameters
        self._low = max(SMALLEST_HOVER, min(0.8, told.hover - told.thrust_range))
        self._high = max(0.2, min(0.9, told.hover + told.thrust_range))
        gate = max(told.gate, SMALLEST_GATE)
        self._gate_squared, self._noise_squared = gate * gate, told.noise * told.noise

    def _reset(self) -> None:
        self._hover = max(0.1, min(0.9, self._parameters.hover))
        self._variance = self._parameters.error * self._parameters.error
        self._accel_variance = ACCEL_VARIANCE
        self._residual = self._signed_ratio = 0.0
        self._valid_s = 0.0

    def stop(self, now_us: int, armed: bool) -> None:
        """On the ground: what was learnt stays until the vehicle is disarmed, but is not called valid."""
        self._valid_s = 0.0
        if not armed:
            self._reset()
        if self.estimate.valid:
            self.estimate = INVALID._replace(timestamp=now_us)

    def update(
        self, now_us: int, dt_s: float, accel_up_m_s2: float, thrust: float, vertical_m_s: float, horizontal_m_s: float
    ) -> None:
        """One sample: acceleration up (without gravity) under a vertical thrust (0..1), at these speeds.

        The estimate is told every 40 ms, and when it becomes valid.
        """
        told = self._parameters
        noise = self._noise_squared * dt_s * dt_s
        state_variance = self._variance + noise
        # Drag and prop wash would bias it in fast motion.
        scale = max(vertical_m_s - told.fast_vertical_m_s, horizontal_m_s - told.fast_horizontal_m_s, 0.0) + 1.0
        hover, accel_variance = self._hover, self._accel_variance
        slope = -GRAVITY_M_S2 * thrust / (hover * hover)
        innovation = residual = accel_up_m_s2 - GRAVITY_M_S2 * (thrust / hover - 1.0)
        variance = slope * slope * state_variance + accel_variance * scale * scale
        ratio = innovation * innovation / (self._gate_squared * variance)
        if ratio < 1.0:
            gain = state_variance * slope / variance
            hover += gain * innovation
            self._hover = hover = self._low if hover < self._low else self._high if hover > self._high else hover
            state_variance = max(LEAST_VARIANCE, min(MOST_VARIANCE, state_variance * (1.0 - gain * slope)))
            residual = accel_up_m_s2 - GRAVITY_M_S2 * (thrust / hover - 1.0)
        elif abs(self._signed_ratio) > LARGE_OFFSET:
            state_variance += RECOVERY_NOISE * noise
        self._variance = state_variance
        weight = dt_s / (LOW_PASS_TIME_CONSTANT_S + dt_s)
        self._residual += weight * (residual - self._residual)
        self._signed_ratio += weight * (math.copysign(min(ratio, 1.0), innovation) - self._signed_ratio)
        spread = residual - self._residual
        measured = spread * spread + slope * slope * state_variance
        accel_variance += dt_s / (NOISE_TIME_CONSTANT_S + dt_s) * (measured - accel_variance)
        self._accel_variance = max(LEAST_ACCEL_VARIANCE, min(MOST_ACCEL_VARIANCE, accel_variance))
        was_valid = self.estimate.valid
        good = state_variance < VALID_VARIANCE and (was_valid or ratio < 1.0)
        self._valid_s = self._valid_s + dt_s if good else 0.0
        valid = self._valid_s >= VALID_AFTER_S
        if now_us - self._told_us >= TOLD_EVERY_US or valid is not was_valid:
            self._told_us = now_us
            told_of_noise = (innovation, variance, ratio, self._accel_variance)
            self.estimate = HoverThrustEstimate(now_us, hover, valid, state_variance, *told_of_noise)

    @property
    def hover_thrust(self) -> float:
        """The present estimate, valid or not."""
        return self._hover
