"""At rest the velocity is zero, and what the gyro turns is its bias.

PX4's EKF2 (EKF/aid_sources/ZeroVelocityUpdate.cpp and ZeroGyroUpdate.cpp, v1.18): five times a second; the velocity
only while nothing else measures the vertical one, or the tilt is not known well yet.
"""

from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.ekf import GYRO_BIAS, Ekf
from sitl_emu.autopilot.estimator.samples import ImuSample
from sitl_emu.autopilot.topics import Vector3

EVERY_US: Final = 200_000
GYRO_INTERVAL_S: Final = 0.2
LEVELLING_NOISE_M_S: Final = 0.001
NOISE_M_S: Final = 0.2
"""At first firm, to find the tilt; later soft, so that the filter can follow a drift."""


class ZeroVelocity:
    """`fused_us`: when it last was."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.fused_us = 0

    def control(self, time_us: int) -> None:
        """One step of the filter."""
        ekf, flags = self._ekf, self._ekf.flags
        if self.fused_us + EVERY_US >= time_us or not (flags.vehicle_at_rest and ekf.was_at_rest):
            return
        if ekf.flags.vertical_velocity_aiding and flags.tilt_align:
            return
        variance = NOISE_M_S**2 if flags.tilt_align else LEVELLING_NOISE_M_S**2
        state = ekf.state
        variances = [ekf.variance(cov.VELOCITY + axis) + variance for axis in range(3)]
        for axis, innovation in enumerate((state.vn, state.ve, state.vd)):
            ekf.fuse_state(cov.VELOCITY + axis, innovation, variances[axis], variance)
        ekf.apply()
        self.fused_us = time_us


class ZeroGyro:
    """Gathers what the gyro turns at rest."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self._restart()

    def _restart(self) -> None:
        self._turn: Vector3 = (0.0, 0.0, 0.0)
        self._dt_s = 0.0

    def control(self, imu: ImuSample) -> None:
        """One step of the filter."""
        ekf = self._ekf
        if not int(ekf.settings["EKF2_IMU_CTRL"]) & GYRO_BIAS:
            return
        if not ekf.flags.vehicle_at_rest:
            if ekf.was_at_rest:
                self._restart()
            return
        x, y, z = self._turn
        ax, ay, az = imu.delta_angle
        self._turn = (x + ax, y + ay, z + az)
        self._dt_s += imu.dt_s
        if self._dt_s < GYRO_INTERVAL_S:
            return
        variance = min(max(ekf.settings["EKF2_GYR_NOISE"], 0.0), 1.0) ** 2
        for axis, (turn, bias) in enumerate(zip(self._turn, ekf.state.gyro_bias, strict=True), cov.GYRO_BIAS):
            ekf.fuse_state(axis, bias - turn / self._dt_s, ekf.variance(axis) + variance, variance)
        ekf.apply()
        self._restart()
