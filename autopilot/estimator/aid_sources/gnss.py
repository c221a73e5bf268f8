"""Position and velocity from GNSS, and the emergency yaw that follows from them.

PX4's EKF2 (EKF/aid_sources/gnss/gps_control.cpp, v1.18). The first good fix is the origin of the local frame.
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.aid_sources.gnss_checks import GnssChecks
from sitl_emu.autopilot.estimator.ekf import RESET_TIMEOUT_US, Ekf
from sitl_emu.autopilot.estimator.resets import from_nowhere_m, reset_to_place, reset_velocity, reset_yaw
from sitl_emu.autopilot.estimator.samples import GnssSample, ImuSample, SampleBuffer
from sitl_emu.autopilot.estimator.yaw_estimator import YawEstimator
from sitl_emu.autopilot.topics import Vector3
from sitl_emu.core.geodesy import MapProjection, wrap_pi

SENS_EN: Final = 1 << 0
"""Its bit of EKF2_SENS_EN."""
HPOS: Final = 1
VPOS: Final = 2
VEL: Final = 4
YAW: Final = 8
"""Bits of EKF2_GPS_CTRL."""
DEAD_RECKONING: Final = 1
"""EKF2_GPS_MODE: reset only where nothing else gives a velocity."""
YAW_RESET_DELAY_US: Final = 1_000_000
YAW_FAILURE_RAD = math.radians(25.0)
VERTICAL_NOISE_FACTOR: Final = 1.5
LEAST_NOISE: Final = 0.01


class Gnss:
    """`sample` is the one at the horizon, `ready` whether it came just now and passed the checks.

    `stopped`: the receiver was just given up, its height as well.
    """

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.buffer: SampleBuffer[GnssSample] = SampleBuffer(ekf.observation_buffer_length)
        self.checks = GnssChecks(ekf)
        self.yaw_estimator = YawEstimator()
        self.pos, self.vel = AidSource(2), AidSource(3)
        self.sample: GnssSample | None = None
        self.ready = self.stopped = False

    @property
    def intended(self) -> bool:
        """Parameters and commands want it."""
        return bool(int(self._ekf.settings["EKF2_GPS_CTRL"])) and bool(self._ekf.sens_en & SENS_EN)

    def control(self, imu: ImuSample) -> None:
        """One step of the filter."""
        ekf, flags = self._ekf, self._ekf.flags
        self.ready = self.stopped = False
        if not self.buffer.pushed_us or not self.intended:
            self.stop()
            return
        sample = self.buffer.pop(imu.time_us)
        if sample is not None:
            self.sample = sample
            self._on_sample(imu, sample)
        elif (flags.gnss_vel or flags.gnss_pos) and not ekf.newest_recent(self.buffer.pushed_us, RESET_TIMEOUT_US):
            self.stop()

    def follow(self, imu: ImuSample, steps: int) -> None:
        """Several steps of the filter, added up, for the yaw estimator."""
        flags = self._ekf.flags
        if self.buffer.pushed_us and self.intended:
            flying = flags.in_air and not flags.vehicle_at_rest
            bias = self._ekf.state.gyro_bias
            self.yaw_estimator.predict(imu, steps, bias, at_rest=flags.vehicle_at_rest, flying=flying)

    def _on_sample(self, imu: ImuSample, sample: GnssSample) -> None:
        ekf, flags = self._ekf, self._ekf.flags
        passed_before = self.checks.initial_passed
        self.ready = self.checks.run(sample)
        if self.ready:
            if not passed_before:
                ekf.events.add("gps_checks_passed")
        elif (flags.gnss_vel or flags.gnss_pos) and ekf.timed_out(self.checks.last_pass_us, RESET_TIMEOUT_US):
            self.stop()
        self._update_position(sample)
        self._update_velocity(imu, sample)
        if not self.ready:
            return
        self._control_yaw_estimator()
        force_reset = self._yaw_emergency()
        self._control_velocity(force_reset=force_reset)
        self._control_position(force_reset=force_reset)
        ekf.apply()

    # --- observations --------------------------------------------------------------------------------------

    def offset(self, sample: GnssSample) -> Vector3:
        """The antenna as seen from the IMU, in the body's axes (m)."""
        (x, y, z), (ix, iy, iz) = sample.antenna, self._ekf.imu_position
        return x - ix, y - iy, z - iz

    def _update_velocity(self, imu: ImuSample, sample: GnssSample) -> None:
        ekf, aid = self._ekf, self.vel
        state, value = ekf.state, ekf.settings
        x, y, z = self.offset(sample)
        vn, ve, vd = sample.vel
        if x or y or z:
            gx, gy, gz = (turn / imu.dt_s - bias for turn, bias in zip(imu.delta_angle, state.gyro_bias, strict=True))
            on, oe, od = state.to_earth(gy * z - gz * y, gz * x - gx * z, gx * y - gy * x)
            vn, ve, vd = vn - on, ve - oe, vd - od
        variance = max(sample.sacc, value["EKF2_GPS_V_NOISE"], LEAST_NOISE) ** 2
        variances = (variance, variance, variance * VERTICAL_NOISE_FACTOR**2)
        innovation_variances = [ekf.variance(cov.VELOCITY + axis) + variances[axis] for axis in range(3)]
        innovations = (state.vn - vn, state.ve - ve, state.vd - vd)
        gate = max(value["EKF2_GPS_V_GATE"], 1.0)
        aid.update(sample.time_us, (vn, ve, vd), variances, innovations, innovation_variances, gate)
        # A bad accelerometer is to be corrected by a good receiver, whatever it says of the vertical.
        horizontal_good = aid.test_ratio[0] < 1.0 and aid.test_ratio[1] < 1.0
        accurate = sample.sacc < value["EKF2_REQ_SACC"]
        if ekf.faults.bad_acc_vertical and aid.test_ratio[2] > 1.0 and horizontal_good and accurate:
            aid.clip(2)

    def _update_position(self, sample: GnssSample) -> None:
        ekf, aid = self._ekf, self.pos
        state, value = ekf.state, ekf.settings
        noise = max(sample.hacc, value["EKF2_GPS_P_NOISE"])
        if not ekf.flags.other_horizontal_aid(ekf.flags.gnss_pos):
            # Nothing else holds the attitude: the receiver has to, however poor it is.
            noise = min(noise, value["EKF2_NOAID_NOISE"])
        variance = max(noise, LEAST_NOISE) ** 2
        place = self._place(sample)
        north, east = from_nowhere_m(*place, 0.0) if ekf.origin is None else ekf.origin.project(*place)
        innovations = (state.pn - north, state.pe - east)
        variances = (ekf.variance(cov.POSITION) + variance, ekf.variance(cov.POSITION + 1) + variance)
        gate = max(value["EKF2_GPS_P_GATE"], 1.0)
        aid.update(sample.time_us, place, (variance, variance), innovations, variances, gate)

    def _place(self, sample: GnssSample) -> tuple[float, float]:
        """Latitude and longitude of the IMU: the antenna's, less where that sits."""
        offset = self.offset(sample)
        if not any(offset):
            return sample.lat, sample.lon
        north, east, _ = self._ekf.state.to_earth(*offset)
        return MapProjection(sample.lat, sample.lon).reproject(-north, -east)

    # --- velocity ------------------------------------------------------------------------------------------

    def _control_velocity(self, *, force_reset: bool) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.vel
        usable = (
            int(ekf.settings["EKF2_GPS_CTRL"]) & VEL
            and flags.tilt_align
            and flags.yaw_align
            and not flags.gnss_fault
            and not flags.gnss_hgt_fault
        )
        if flags.gnss_vel:
            if not usable:
                self._stop_velocity()
                return
            ekf.fuse_velocity(aid)
            if ekf.timed_out(aid.time_last_fuse, RESET_TIMEOUT_US) or force_reset:
                if force_reset or self._velocity_reset_allowed():
                    self._reset_velocity()
                else:
                    self._stop_velocity()
        elif usable and self.checks.passed:
            fits = aid.test_ratio[0] < 1.0 and aid.test_ratio[1] < 1.0
            started = ekf.was_yaw_aligned and not force_reset and fits and ekf.fuse_velocity(aid)
            if not started and (force_reset or self._velocity_reset_allowed()):
                self._reset_velocity()
                started = True
            if started:
                ekf.events.add("starting_gps_fusion")
                flags.gnss_vel = True

    def _velocity_reset_allowed(self) -> bool:
        ekf, flags = self._ekf, self._ekf.flags
        if flags.gnss_fault:
            return False
        if int(ekf.settings["EKF2_GPS_MODE"]) == DEAD_RECKONING:
            return not ekf.flags.other_horizontal_aid(flags.gnss_vel)
        return flags.wind_dead_reckoning or ekf.flags.horizontal_velocity_aids() <= int(flags.gnss_vel)

    def _reset_velocity(self) -> None:
        ekf, aid = self._ekf, self.vel
        ekf.events.add("reset_vel_to_gps")
        n, e, d = aid.observation
        a, b, c = aid.observation_variance
        reset_velocity(ekf, (n, e, d), (a, b, c))
        aid.reset(ekf.time_us)

    def _stop_velocity(self) -> None:
        flags = self._ekf.flags
        if flags.gnss_vel:
            flags.gnss_vel = False
            if not flags.gnss_pos:
                self.checks.reset()

    # --- position ------------------------------------------------------------------------------------------

    def _control_position(self, *, force_reset: bool) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.pos
        enabled = bool(int(ekf.settings["EKF2_GPS_CTRL"]) & HPOS)
        usable = enabled and flags.tilt_align and flags.yaw_align and not flags.gnss_hgt_fault
        if flags.gnss_pos:
            if not usable:
                self._stop_position()
                return
            ekf.fuse_horizontal_position(aid)
            if ekf.timed_out(aid.time_last_fuse, RESET_TIMEOUT_US) or force_reset:
                if self._position_reset_allowed():
                    self._reset_position()
                else:
                    self._stop_position()
                    flags.gnss_fault = True
            return
        if not enabled or not self.checks.passed:
            return
        if not usable:
            if ekf.origin is None:
                self._reset_position()
            return
        fits = aid.test_ratio[0] < 1.0 and aid.test_ratio[1] < 1.0
        started = False
        if ekf.origin is not None and ekf.was_yaw_aligned and not force_reset and fits:
            started = ekf.fuse_horizontal_position(aid)
        if ekf.origin is None or (not started and self._position_reset_allowed()):
            self._reset_position()
            started = True
        if started:
            ekf.events.add("starting_gps_fusion")
            flags.gnss_pos, flags.gnss_fault = True, False

    def _position_reset_allowed(self) -> bool:
        ekf, flags = self._ekf, self._ekf.flags
        if flags.gnss_fault:
            return False
        if int(ekf.settings["EKF2_GPS_MODE"]) == DEAD_RECKONING:
            return not ekf.flags.other_horizontal_aid(flags.gnss_pos)
        return ekf.flags.horizontal_position_aids() <= int(flags.gnss_pos)

    def _reset_position(self) -> None:
        ekf, aid = self._ekf, self.pos
        ekf.events.add("reset_pos_to_gps")
        latitude, longitude = aid.observation
        reset_to_place(ekf, latitude, longitude, aid.observation_variance[0] + aid.observation_variance[1])
        aid.reset(ekf.time_us)

    def _stop_position(self) -> None:
        flags = self._ekf.flags
        if flags.gnss_pos:
            flags.gnss_pos = False
            if not flags.gnss_vel:
                self.checks.reset()

    # --- yaw -----------------------------------------------------------------------------------------------

    def _control_yaw_estimator(self) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.vel
        accuracy = math.sqrt(aid.observation_variance[0])
        vn, ve = aid.observation[0], aid.observation[1]
        if not accuracy < ekf.settings["EKF2_REQ_SACC"] or not math.isfinite(vn + ve):
            return
        self.yaw_estimator.fuse_velocity(vn, ve, accuracy, in_air=flags.in_air)
        wanted = int(ekf.settings["EKF2_GPS_CTRL"]) & (VEL | HPOS)
        if wanted and not flags.yaw_align and flags.tilt_align:
            self._reset_yaw()

    def _reset_yaw(self) -> bool:
        ekf, estimator = self._ekf, self.yaw_estimator
        if not estimator.converged:
            return False
        reset_yaw(ekf, estimator.yaw, estimator.variance)
        ekf.flags.yaw_align = True
        ekf.events.add("yaw_aligned_to_imu_gps")
        return True

    def _yaw_emergency(self) -> bool:
        """In flight, GNSS disagrees for a second, and so does the yaw that follows from it: that yaw it is."""
        ekf, flags, estimator = self._ekf, self._ekf.flags, self.yaw_estimator
        if flags.gnss_fault or not flags.in_air or not estimator.converged:
            return False
        if abs(wrap_pi(ekf.state.yaw - estimator.yaw)) <= YAW_FAILURE_RAD:
            return False

        def fails(in_use: bool, aid: AidSource, fused_us: int) -> bool:
            late = ekf.timed_out(fused_us, YAW_RESET_DELAY_US) and fused_us > ekf.on_ground_us
            return in_use and aid.innovation_rejected and late

        if not (
            fails(flags.gnss_vel, self.vel, ekf.hor_vel_fused_us)
            or fails(flags.gnss_pos, self.pos, ekf.hor_pos_fused_us)
        ):
            return False
        self._reset_yaw()
        ekf.forget_gyro_bias_z()
        flags.mag_fault = flags.mag_fault or flags.mag_hdg or flags.mag_3d
        flags.ev_yaw_fault = flags.ev_yaw_fault or flags.ev_yaw
        return True

    # --- end -----------------------------------------------------------------------------------------------

    def stop(self) -> None:
        """Use the receiver no more."""
        flags = self._ekf.flags
        if flags.gnss_vel or flags.gnss_pos:
            self.checks.reset()
        self._stop_velocity()
        self._stop_position()
        self.stopped = True
        self.yaw_estimator.reset()
