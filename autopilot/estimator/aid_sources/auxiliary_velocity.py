"""Horizontal velocity against a precision landing's target that stands, as a camera sees it.

PX4's EKF2 (EKF/aid_sources/auxvel, EKF2::UpdateAuxVelSample, v1.18; EKF2_AVEL_EN).
"""

from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.samples import AuxiliaryVelocitySample, SampleBuffer

GATE: Final = 5.0
"""auxvel_gate (EKF/common.h)."""


class AuxiliaryVelocity:
    """Fused where something else aids the horizontal states, too."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.buffer: SampleBuffer[AuxiliaryVelocitySample] = SampleBuffer(ekf.observation_buffer_length)
        self.aid = AidSource(2)

    def control(self, time_us: int) -> None:
        """One step of the filter, at `time_us` of the delayed IMU."""
        sample = self.buffer.pop(time_us)
        if sample is None:
            return
        ekf, (vn, ve), variances = self._ekf, sample.velocity, sample.variances
        innovation = (ekf.state.vn - vn, ekf.state.ve - ve)
        told = [ekf.variance(cov.VELOCITY + axis) + variance for axis, variance in enumerate(variances)]
        self.aid.update(sample.time_us, sample.velocity, variances, innovation, told, GATE)
        if ekf.flags.horizontal_aiding:
            ekf.fuse_velocity(self.aid)
            ekf.apply()
