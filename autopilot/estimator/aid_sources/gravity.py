"""Roll and pitch from where gravity is felt, while nothing aids horizontally (bit 2 of EKF2_IMU_CTRL).

PX4's EKF2 (EKF/aid_sources/gravity/gravity_fusion.cpp, v1.18). PX4 fuses at every step; here the mean of some steps is
fused, and weighs as much as they do together. What is not fused is worked out eight times a second (every 100 ms, when
it is looked after), for the log.
"""

import math
from typing import Final

import numpy as np

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import GRAVITY_VECTOR, Ekf
from sitl_emu.autopilot.estimator.samples import ImuSample
from sitl_emu.autopilot.topics import Vector3

GRAVITY_M_S2: Final = 9.80665
GATE: Final = 0.25
NOT_FUSED_EVERY_US: Final = 100_000


class Gravity:
    """The accelerometer as a plumb line."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.aid = AidSource(3)

    def control(self, imu: ImuSample, steps: int) -> None:
        """Several steps of the filter, added up."""
        ekf, flags = self._ekf, self._ekf.flags
        assert ekf.accel_mean is not None
        quiet = 0.9 * GRAVITY_M_S2 < math.hypot(*ekf.accel_mean) < 1.1 * GRAVITY_M_S2
        flags.gravity_vector = (
            bool(int(ekf.settings["EKF2_IMU_CTRL"]) & GRAVITY_VECTOR)
            and (quiet or flags.vehicle_at_rest)
            and not ekf.flags.horizontal_aiding
            and flags.tilt_align
        )
        if flags.gravity_vector or imu.time_us >= self.aid.timestamp_sample + NOT_FUSED_EVERY_US:
            self._update(imu, steps)

    def _update(self, imu: ImuSample, steps: int) -> None:
        ekf, aid, state = self._ekf, self.aid, self._ekf.state
        felt = [velocity / imu.dt_s - bias for velocity, bias in zip(imu.delta_velocity, state.accel_bias, strict=True)]
        norm = math.hypot(*felt) or 1.0
        measured = (felt[0] / norm, felt[1] / norm, felt[2] / norm)
        variance = max(ekf.settings["EKF2_GRAV_NOISE"], 0.01) ** 2
        rotation = state.rotation
        jacobians = [_jacobian(rotation, axis) for axis in range(3)]
        told = [ekf.innovation_variance(h, variance)[1] for h in jacobians]
        aid.update(imu.time_us, measured, (variance,) * 3, _innovation(rotation, measured), told, GATE)
        if not ekf.flags.gravity_vector or aid.innovation_rejected:
            return
        for axis, h in enumerate(jacobians):
            ph, own = ekf.innovation_variance(h, 0.0)
            aid.innovation_variance[axis] = own + variance
            aid.innovation[axis] = _innovation(state.rotation, measured)[axis]
            ekf.fuse(ph, aid.innovation[axis], own + variance / steps)
        aid.fused, aid.time_last_fuse = True, imu.time_us


def _innovation(rotation: tuple[float, ...], measured: Vector3) -> Vector3:
    return -rotation[6] - measured[0], -rotation[7] - measured[1], -rotation[8] - measured[2]


def _jacobian(rotation: tuple[float, ...], axis: int) -> cov.Matrix:
    """Of the direction "up" along a body axis, by the attitude: the cross product of that axis (NED) and up."""
    h = np.zeros(cov.STATES)
    h[0], h[1] = -rotation[3 + axis], rotation[axis]
    return h
