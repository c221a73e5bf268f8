"""Optical flow: what the ground moves in the camera, fused as angular rates; it shows velocity and height above ground.

PX4's EKF2 (EKF/aid_sources/optical_flow: optical_flow_control.cpp, optical_flow_fusion.cpp, v1.18).
"""

import math
from typing import Final

import numpy as np

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import NO_AID_TIMEOUT_US, RANGE, RESET_TIMEOUT_US, SENSOR_WEIGHT, Ekf
from sitl_emu.autopilot.estimator.resets import count_terrain_reset, reset_horizontal_velocity
from sitl_emu.autopilot.estimator.samples import FlowSample, ImuSample, SampleBuffer
from sitl_emu.autopilot.topics import Vector3

SENS_EN: Final = 1 << 2
"""Its bit of EKF2_SENS_EN."""
INTERNAL_GYRO: Final = 1
"""EKF2_OF_GYR_SRC: never the sensor's own."""
LARGEST_TILT_COS: Final = 0.7071
LEAST_NOISE_RAD_S: Final = 0.05
LEAST_HAGL_M: Final = 0.01
SAMPLES_BEFORE_USE: Final = 10
RESTART_AFTER_US: Final = 2_000_000
GYRO_BIAS_WEIGHT: Final = 0.01
GYRO_SPIKE_RAD_S: Final = 0.1
UNKNOWN_TERRAIN_VARIANCE: Final = 100.0
BEST_QUALITY: Final = 255.0


class OpticalFlow:
    """`limits`: largest rate (rad/s), least and greatest distance (m) that the sensor says of itself."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.buffer: SampleBuffer[FlowSample] = SampleBuffer(ekf.imu_buffer_length)
        self.aid = AidSource(2)
        self.limits = (0.0, 0.0, 0.0)
        self._gyro_bias: Vector3 = (0.0, 0.0, 0.0)
        self._sample_us = self._count = 0
        self._velocity_body = self._rate_mean = (0.0, 0.0)
        """Low-passed."""

    @property
    def intended(self) -> bool:
        """Parameters and commands want it."""
        return bool(int(self._ekf.settings["EKF2_OF_CTRL"])) and bool(self._ekf.sens_en & SENS_EN)

    def control(self, imu: ImuSample) -> None:
        """One step of the filter."""
        ekf, flags = self._ekf, self._ekf.flags
        if not self.buffer.pushed_us or not self.intended:
            self.stop()
            return
        sample = self.buffer.pop(imu.time_us)
        if sample is not None:
            self._on_sample(imu, sample)
        elif flags.opt_flow and ekf.timed_out(self._sample_us, RESET_TIMEOUT_US):
            self.stop()

    def _on_sample(self, imu: ImuSample, sample: FlowSample) -> None:
        ekf, flags, value = self._ekf, self._ekf.flags, self._ekf.settings
        self._sample_us = sample.time_us
        gyro = self._gyro(imu, sample)
        rate = (sample.flow_rate[0] - gyro[0], sample.flow_rate[1] - gyro[1])
        variance = self._variance(sample.quality)
        told = [ekf.innovation_variance(self._jacobian(axis), variance)[1] for axis in range(2)]
        predicted = self._predicted(gyro)
        innovation = (predicted[0] - rate[0], predicted[1] - rate[1])
        gate = max(value["EKF2_OF_GATE"], 1.0)
        self.aid.update(sample.time_us, rate, (variance, variance), innovation, told, gate)
        self._average(rate)
        fastest, nearest, farthest = self.limits
        least = value["EKF2_OF_QMIN"] if flags.in_air else value["EKF2_OF_QMIN_GND"]
        good = sample.quality >= least and math.hypot(*sample.flow_rate) <= fastest and math.hypot(*rate) <= fastest
        level = ekf.state.rotation[8] > LARGEST_TILT_COS
        usable = flags.tilt_align and nearest <= ekf.hagl_m <= farthest
        # A height that is relative to the ground says nothing about where the ground is.
        flags.opt_flow_terrain = flags.opt_flow and ekf.height_reference != RANGE
        if flags.opt_flow:
            if usable:
                self._continue(gyro, variance, good=good, level=level)
            else:
                self.stop()
        elif usable and good and level and self._count > SAMPLES_BEFORE_USE:
            known = ekf.hagl_valid or ekf.flags.horizontal_aiding
            if known and ekf.timed_out(self.aid.time_last_fuse, RESTART_AFTER_US):
                self._start(gyro, variance)
        ekf.apply()

    # --- what was measured ---------------------------------------------------------------------------------

    def _gyro(self, imu: ImuSample, sample: FlowSample) -> Vector3:
        """The sensor's rotation in its sign convention, its bias against the filter's gyro removed."""
        ekf = self._ekf
        own = [-(turn / imu.dt_s - bias) for turn, bias in zip(imu.delta_angle, ekf.state.gyro_bias, strict=True)]
        told = list(sample.gyro_rate)
        internal = int(ekf.settings["EKF2_OF_GYR_SRC"]) == INTERNAL_GYRO
        if internal or not math.isfinite(told[0] + told[1]):
            told = own
        elif not math.isfinite(told[2]):
            told[2] = own[2]
        parts = []
        for bias, rate, reference in zip(self._gyro_bias, told, own, strict=True):
            difference = min(max(rate - reference, -GYRO_SPIKE_RAD_S), GYRO_SPIKE_RAD_S)
            parts.append(bias + GYRO_BIAS_WEIGHT * (difference - bias))
        self._gyro_bias = (parts[0], parts[1], parts[2])
        return told[0] - parts[0], told[1] - parts[1], told[2] - parts[2]

    def _variance(self, quality: int) -> float:
        value = self._ekf.settings
        best = max(value["EKF2_OF_N_MIN"], LEAST_NOISE_RAD_S)
        worst = max(value["EKF2_OF_N_MAX"], LEAST_NOISE_RAD_S)
        least = value["EKF2_OF_QMIN"]
        span = BEST_QUALITY - least
        weight = min(max((quality - least) / span, 0.0), 1.0) if span >= 1.0 else 0.0
        return (best * weight + worst * (1.0 - weight)) ** 2

    def _hagl(self) -> float:
        """Height of the camera above the ground; never so small that rates become absurd."""
        _, _, below = self._ekf.state.to_earth(*self._ekf.offsets["OF"])
        return max(abs(self._ekf.hagl_m - below), LEAST_HAGL_M)

    def _predicted(self, gyro: Vector3) -> tuple[float, float]:
        """Angular rates that the filter expects."""
        state, (x, y, z), (gx, gy, gz) = self._ekf.state, self._ekf.offsets["OF"], gyro
        vx, vy, _ = state.to_body(state.vn, state.ve, state.vd)
        vx -= gy * z - gz * y
        vy -= gz * x - gx * z
        scale = state.rotation[8] / self._hagl()
        return vy * scale, -vx * scale

    def _jacobian(self, axis: int) -> cov.Matrix:
        """Of rate `axis`, which velocity along the other body axis makes."""
        state, hagl = self._ekf.state, self._hagl()
        r = state.rotation
        other, sign = (1, 1.0) if axis == 0 else (0, -1.0)
        bx, by, bz = r[other], r[3 + other], r[6 + other]
        vn, ve, vd = state.vn, state.ve, state.vd
        along = bx * vn + by * ve + bz * vd
        scale = sign * r[8] / hagl
        h = np.zeros(cov.STATES)
        tilt = sign * along / hagl
        h[0] = scale * (by * vd - bz * ve) + tilt * r[5]
        h[1] = scale * (bz * vn - bx * vd) - tilt * r[2]
        h[2] = scale * (bx * ve - by * vn)
        h[3:6] = (scale * bx, scale * by, scale * bz)
        by_height = scale * along / hagl
        h[cov.HEIGHT], h[cov.TERRAIN] = by_height, -by_height
        return h

    def _average(self, rate: tuple[float, float]) -> None:
        distance = self._hagl() / max(self._ekf.state.rotation[8], 1e-3)
        velocity = (-rate[1] * distance, rate[0] * distance)
        weight = SENSOR_WEIGHT if self._count else 1.0
        (x, y), (a, b) = self._velocity_body, self._rate_mean
        self._velocity_body = (x + weight * (velocity[0] - x), y + weight * (velocity[1] - y))
        self._rate_mean = (a + weight * (rate[0] - a), b + weight * (rate[1] - b))
        self._count += 1

    # --- fusion --------------------------------------------------------------------------------------------

    def _continue(self, gyro: Vector3, variance: float, *, good: bool, level: bool) -> None:
        """What a tilted camera sees is not fused; who relies on flow alone takes its velocity after a second."""
        ekf, flags = self._ekf, self._ekf.flags
        if good and level:
            self._fuse(gyro)
        if not ekf.timed_out(self.aid.time_last_fuse, NO_AID_TIMEOUT_US):
            return
        needed = flags.in_air and (flags.inertial_dead_reckoning or not ekf.flags.other_horizontal_aid(flags.opt_flow))
        if needed and good:
            self._reset_velocity(variance)
            if flags.opt_flow_terrain and not ekf.terrain_valid:
                self._reset_terrain()
        else:
            self.stop()

    def _start(self, gyro: Vector3, variance: float) -> None:
        ekf, flags = self._ekf, self._ekf.flags
        flags.opt_flow_terrain = ekf.height_reference != RANGE
        if ekf.flags.horizontal_aiding:
            if self._fuse(gyro):
                flags.opt_flow = True
            elif flags.opt_flow_terrain and not flags.rng_terrain:
                self._reset_terrain()
                flags.opt_flow = True
        elif ekf.hagl_valid:
            self._reset_velocity(variance)
            flags.opt_flow = True
        elif flags.opt_flow_terrain:
            self._reset_terrain()
            flags.opt_flow = True
        flags.opt_flow_terrain = flags.opt_flow and ekf.height_reference != RANGE

    def _fuse(self, gyro: Vector3) -> bool:
        ekf, aid, gate = self._ekf, self.aid, max(self._ekf.settings["EKF2_OF_GATE"], 1.0)
        if aid.innovation_rejected:
            return False
        terrain = ekf.flags.opt_flow_terrain
        jacobians = [self._jacobian(axis) for axis in range(2)]
        for axis, h in enumerate(jacobians):
            variance = aid.observation_variance[axis]
            ph, aid.innovation_variance[axis] = ekf.innovation_variance(h, variance)
            if axis:
                aid.innovation[axis] = self._predicted(gyro)[axis] - aid.observation[axis]
                aid.test_ratio[axis] = aid.innovation[axis] ** 2 / (gate**2 * aid.innovation_variance[axis])
                if aid.test_ratio[axis] > 1.0:
                    continue
            gain = ph / aid.innovation_variance[axis]
            if not terrain:
                gain[cov.TERRAIN] = 0.0
            ekf.fuse_by(gain, ph, aid.innovation[axis], aid.innovation_variance[axis])
        aid.fused, aid.time_last_fuse = True, ekf.time_us
        ekf.hor_vel_fused_us = ekf.time_us
        if terrain:
            ekf.terrain_fused_us = ekf.time_us
        return True

    def _reset_velocity(self, variance: float) -> None:
        ekf = self._ekf
        ekf.events.add("reset_vel_to_flow")
        distance = self._hagl() / max(ekf.state.rotation[8], 1e-3)
        n, e, _ = ekf.state.to_earth(*self._velocity_body, 0.0)
        told = distance * distance * variance
        reset_horizontal_velocity(ekf, (n, e), (told, told))
        self.aid.reset(ekf.time_us)

    def _reset_terrain(self) -> None:
        """Where something else knows the velocity, the flow tells the distance; else the ground is taken to be near."""
        ekf, state = self._ekf, self._ekf.state
        clearance = ekf.settings["EKF2_MIN_RNG"]
        distance = clearance
        if ekf.flags.other_horizontal_aid(ekf.flags.opt_flow):
            n, e, _ = state.to_earth(-self._rate_mean[1], self._rate_mean[0], 0.0)
            if math.hypot(n, e) > 1e-6:
                distance = max(math.hypot(state.vn, state.ve) / math.hypot(n, e), clearance)
        terrain = distance - state.alt
        count_terrain_reset(ekf, terrain - state.terrain)
        state.terrain = terrain
        cov.uncorrelate(ekf.p, cov.TERRAIN, (UNKNOWN_TERRAIN_VARIANCE,))
        self.aid.reset(ekf.time_us)

    def stop(self) -> None:
        """Flow is used no more."""
        flags = self._ekf.flags
        if flags.opt_flow:
            flags.opt_flow = flags.opt_flow_terrain = False
            self._count = 0
