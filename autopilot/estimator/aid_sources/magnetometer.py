"""The magnetometer: field states, heading, and where magnetic north is.

PX4's EKF2 (EKF/aid_sources/magnetometer: mag_control.cpp, mag_fusion.cpp, v1.18). Its three axes are fused with the
Earth's field and the body's bias as states; whether attitude follows is EKF2_MAG_TYPE's and the flight's: only the
heading (`mag_hdg`), or all of it once the field was aligned in flight (`mag_3d`). The declination is the magnetic
model's as soon as a place is known (EKF2_DECL_TYPE).
"""

import math
from typing import Final

import numpy as np

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import RESET_TIMEOUT_US, SENSOR_WEIGHT, Ekf
from sitl_emu.autopilot.estimator.resets import reset_yaw
from sitl_emu.autopilot.estimator.samples import MagSample, SampleBuffer
from sitl_emu.autopilot.topics import NAN, Vector3
from sitl_emu.core.geodesy import wrap_pi
from sitl_emu.core.geomagnetism import magnetic_field

SENS_EN: Final = 1 << 10
"""Its bit of EKF2_SENS_EN."""
AUTO: Final = 0
HEADING: Final = 1
NONE: Final = 5
INIT: Final = 6
"""EKF2_MAG_TYPE."""
USE_GEO_DECL: Final = 1
SAVE_GEO_DECL: Final = 2
"""Bits of EKF2_DECL_TYPE."""
STRENGTH: Final = 1
INCLINATION: Final = 2
FORCE_WMM: Final = 4
"""Bits of EKF2_MAG_CHECK."""
MAX_INTERVAL_US: Final = 500_000
WMM_EVERY_US: Final = 10_000_000
HEALTHY_US: Final = 1_000_000
LEAST_FIELD_CHANGE_GA: Final = 0.01
LEAST_VARIANCE: Final = 1e-6
DECLINATION_VARIANCE: Final = 0.5**2
LARGEST_TURN_RAD_S = math.radians(1.0)
ANOMALIES_BELOW_M: Final = 1.5
AVERAGE_FIELD_GA: Final = 0.45
AVERAGE_GATE_GA: Final = 0.40
SAMPLES_BEFORE_USE: Final = 3


class Magnetometer:
    """`declination_rad` is the model's, NaN before a place is known."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.buffer: SampleBuffer[MagSample] = SampleBuffer(ekf.observation_buffer_length)
        self.aid = AidSource(3)
        self._count = 0
        self._mean: Vector3 = (0.0, 0.0, 0.0)
        self.declination_rad = self.inclination_rad = self.strength_ga = NAN
        self._model: Vector3 | None = None
        """Field of the magnetic model here, NED."""
        self._model_checked_us = self._check_failing_us = 0
        self.measured_inclination_rad = self.measured_strength_ga = NAN
        self.heading_innovation = 0.0
        """Low-passed."""
        self.aligned_us = 0
        """When the field was aligned in flight."""

    @property
    def intended(self) -> bool:
        """Parameters and commands want it."""
        return int(self._ekf.settings["EKF2_MAG_TYPE"]) != NONE and bool(self._ekf.sens_en & SENS_EN)

    def control(self, time_us: int) -> None:
        """One step of the filter, at `time_us` of the delayed IMU."""
        ekf = self._ekf
        if not self.intended:
            self.stop()
            return
        sample = self.buffer.pop(time_us)
        if sample is not None:
            self._on_sample(sample)
        elif not ekf.newest_recent(self.buffer.pushed_us, 2 * MAX_INTERVAL_US):
            self.stop()

    def _on_sample(self, sample: MagSample) -> None:
        ekf, flags, value = self._ekf, self._ekf.flags, self._ekf.settings
        self._average(sample)
        model_new = self._update_model()
        mag = self._with_synthetic_z(sample.mag)
        faults = ekf.faults
        faults.bad_mag_x = faults.bad_mag_y = faults.bad_mag_z = False
        variance = max(value["EKF2_MAG_NOISE"], 0.01) ** 2
        self._observe(sample.time_us, mag, variance)
        usable = (
            int(value["EKF2_MAG_TYPE"]) in (INIT, AUTO, HEADING)
            and flags.tilt_align
            and (flags.yaw_align or not flags.ev_yaw)
            and 0.0 < math.hypot(*mag) < math.inf
        )
        startable = (
            usable
            and self._field_healthy(mag)
            and self._count > SAMPLES_BEFORE_USE
            and flags.yaw_align == ekf.was_yaw_aligned
            and ekf.newest_recent(self.buffer.pushed_us, MAX_INTERVAL_US)
        )
        self._check_heading(mag)
        self._choose_mode()
        if not flags.mag:
            if startable:
                self._start(mag, variance, model_new=model_new)
        elif usable and flags.yaw_align:
            self._continue(mag, variance, model_new=model_new)
        else:
            self.stop()

    # --- what was measured ---------------------------------------------------------------------------------

    def _average(self, sample: MagSample) -> None:
        ekf, flags = self._ekf, self._ekf.flags
        if sample.reset or not self._count:
            flags.mag_fault = False
            ekf.state.mag_b = (0.0, 0.0, 0.0)
            self._forget_bias()
            self.stop()
            self._mean, self._count = sample.mag, 1
            if not flags.in_air:
                flags.yaw_align = False  # another calibration: another heading
            return
        mean = zip(self._mean, sample.mag, strict=True)
        x, y, z = (old + SENSOR_WEIGHT * (new - old) for old, new in mean)
        self._mean, self._count = (x, y, z), self._count + 1

    def _with_synthetic_z(self, mag: Vector3) -> Vector3:
        """EKF2_SYNT_MAG_Z: the vertical axis, which currents disturb most, from the other two and the model."""
        ekf, value = self._ekf, self._ekf.settings
        wanted = int(value["EKF2_SYNT_MAG_Z"]) and int(value["EKF2_DECL_TYPE"]) & USE_GEO_DECL
        ekf.flags.synthetic_mag_z = bool(wanted) and self._model is not None
        if not ekf.flags.synthetic_mag_z or self._model is None:
            return mag
        x, y, _ = mag
        z = math.sqrt(max(sum(part * part for part in self._model) - x * x - y * y, 0.0))
        return x, y, math.copysign(z, ekf.state.to_body(*self._model)[2])

    def _observe(self, time_us: int, mag: Vector3, variance: float) -> None:
        ekf = self._ekf
        told = [ekf.innovation_variance(self._jacobian(axis), variance)[1] for axis in range(3)]
        gate = max(ekf.settings["EKF2_MAG_GATE"], 1.0)
        self.aid.update(time_us, mag, (variance,) * 3, self._innovation(mag), told, gate)

    def _innovation(self, mag: Vector3) -> Vector3:
        state = self._ekf.state
        (x, y, z), (bx, by, bz) = state.to_body(*state.mag_i), state.mag_b
        return x + bx - mag[0], y + by - mag[1], z + bz - mag[2]

    def _jacobian(self, axis: int) -> cov.Matrix:
        state = self._ekf.state
        h = np.zeros(cov.STATES)
        rx, ry, rz = state.rotation[axis], state.rotation[3 + axis], state.rotation[6 + axis]
        mx, my, mz = state.mag_i
        h[0:3] = (ry * mz - rz * my, rz * mx - rx * mz, rx * my - ry * mx)
        h[cov.MAG_I : cov.MAG_B] = (rx, ry, rz)
        h[cov.MAG_B + axis] = 1.0
        return h

    # --- the magnetic model --------------------------------------------------------------------------------

    def _update_model(self) -> bool:
        """Look the field up where the vehicle is, when that is new or every ten seconds; True: it changed."""
        ekf = self._ekf
        if ekf.origin is None:
            return False
        origin_is_new = ekf.origin_us > self.aid.time_last_fuse
        due = ekf.local_horizontal_valid and ekf.timed_out(self._model_checked_us, WMM_EVERY_US)
        if not origin_is_new and not due:
            return False
        self._model_checked_us = ekf.time_us
        field = magnetic_field(*ekf.origin.reproject(ekf.state.pn, ekf.state.pe))
        known = self._model is not None
        if known and not (
            abs(field.declination_rad - self.declination_rad) > math.radians(1.0)
            or abs(field.inclination_rad - self.inclination_rad) > math.radians(1.0)
            or abs(field.strength_gauss - self.strength_ga) > 0.01
        ):
            return False
        self.declination_rad, self.inclination_rad, self.strength_ga = field
        horizontal = field.strength_gauss * math.cos(field.inclination_rad)
        self._model = (
            horizontal * math.cos(field.declination_rad),
            horizontal * math.sin(field.declination_rad),
            field.strength_gauss * math.sin(field.inclination_rad),
        )
        return True

    @property
    def _declination(self) -> float:
        """What is taken for the declination: the field state's, the model's, the saved one, or nothing known."""
        ekf, value = self._ekf, self._ekf.settings
        if ekf.flags.mag_aligned_in_flight:
            return math.atan2(ekf.state.mag_i[1], ekf.state.mag_i[0])
        return self._known_declination(int(value["EKF2_DECL_TYPE"]), value["EKF2_MAG_DECL"]) or 0.0

    def _known_declination(self, kind: int, saved_deg: float) -> float | None:
        if kind & USE_GEO_DECL and math.isfinite(self.declination_rad):
            return self.declination_rad
        if kind & SAVE_GEO_DECL and math.isfinite(saved_deg) and saved_deg:
            return math.radians(saved_deg)
        return None

    # --- checks --------------------------------------------------------------------------------------------

    def _field_healthy(self, mag: Vector3) -> bool:
        """Strength and inclination have been as expected for a second (EKF2_MAG_CHECK)."""
        ekf, flags, value = self._ekf, self._ekf.flags, self._ekf.settings
        flags.mag_field_disturbed = False
        check = int(value["EKF2_MAG_CHECK"])
        if not check:
            return True
        failing = False
        self.measured_strength_ga = math.hypot(*mag)
        if check & STRENGTH:
            expected, gate = self.strength_ga, value["EKF2_MAG_CHK_STR"]
            if not math.isfinite(expected):
                expected, gate = AVERAGE_FIELD_GA, AVERAGE_GATE_GA
                failing = bool(check & FORCE_WMM)
            if not failing and not expected - gate <= self.measured_strength_ga <= expected + gate:
                flags.mag_field_disturbed = failing = True
        down = ekf.state.to_earth(*mag)[2]
        self.measured_inclination_rad = math.asin(max(-1.0, min(1.0, down / max(self.measured_strength_ga, 1e-4))))
        if check & INCLINATION:
            if math.isfinite(self.inclination_rad):
                error = wrap_pi(self.measured_inclination_rad - self.inclination_rad)
                if abs(error) > math.radians(value["EKF2_MAG_CHK_INC"]):
                    flags.mag_field_disturbed = failing = True
            elif check & FORCE_WMM:
                failing = True
        if failing or not self._check_failing_us:
            self._check_failing_us = ekf.time_us
        return ekf.time_us - self._check_failing_us > HEALTHY_US

    def _heading_of(self, mag: Vector3) -> float:
        """Heading by the compass: the field, less a bias that is known well, projected onto the horizontal."""
        ekf, state = self._ekf, self._ekf.state
        variances = [ekf.variance(cov.MAG_B + axis) for axis in range(3)]
        bias = (0.0, 0.0, 0.0)
        if min(variances) > 0.0 and max(variances) <= ekf.settings["EKF2_MAG_NOISE"] ** 2:
            bias = state.mag_b
        north, east, _ = state.to_earth(mag[0] - bias[0], mag[1] - bias[1], mag[2] - bias[2])
        return state.yaw - math.atan2(east, north) + self._declination

    def _check_heading(self, mag: Vector3) -> None:
        """Whether the compass agrees with a heading that manoeuvres have shown."""
        ekf, flags = self._ekf, self._ekf.flags
        innovation = wrap_pi(ekf.state.yaw - self._heading_of(mag))
        if flags.yaw_align:
            self.heading_innovation += SENSOR_WEIGHT * (innovation - self.heading_innovation)
        else:
            innovation = self.heading_innovation = 0.0
        largest = ekf.settings["EKF2_HEAD_NOISE"]
        if abs(self.heading_innovation) < largest and abs(innovation) < largest:
            moved = math.hypot(*ekf.state.accel_horizontal) > ekf.settings["EKF2_MAG_ACCLIM"]
            if ekf.north_east_aiding and moved:
                flags.mag_heading_consistent = True
        else:
            flags.mag_heading_consistent = False
        back = flags.mag_fault and flags.mag_heading_consistent and flags.mag
        if back and ekf.timed_out(ekf.heading_fused_us, RESET_TIMEOUT_US):
            flags.mag_fault = False

    def _choose_mode(self) -> None:
        ekf, flags = self._ekf, self._ekf.flags
        kind = int(ekf.settings["EKF2_MAG_TYPE"])
        trusted = flags.mag_heading_consistent or not ekf.north_east_aiding
        common = (
            flags.mag
            and ((flags.yaw_align and trusted) or (not flags.ev_yaw and not flags.yaw_align))
            and not flags.mag_fault
            and not flags.mag_field_disturbed
            and not flags.ev_yaw
            and (not flags.yaw_manual or flags.mag_aligned_in_flight)
            and not flags.constant_pos
        )
        flags.mag_3d = common and kind == AUTO and flags.mag_aligned_in_flight
        flags.mag_hdg = common and (kind == HEADING or (kind == AUTO and not flags.mag_3d))
        flags.mag_dec = flags.mag and self._still_or_lost

    @property
    def _still_or_lost(self) -> bool:
        """Nothing shows where north is, or the vehicle stands."""
        return not self._ekf.north_east_aiding or self._ekf.flags.vehicle_at_rest

    # --- fusion --------------------------------------------------------------------------------------------

    def _start(self, mag: Vector3, variance: float, *, model_new: bool) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        least = min(ekf.variance(index) for index in range(cov.MAG_I, cov.WIND))
        unknown = math.hypot(*ekf.state.mag_i) == 0.0 or least < LEAST_VARIANCE
        if flags.yaw_align and not model_new and not unknown:
            flags.mag = True
            flags.mag = self._fuse(mag, variance, all_states=False, tilt=False)
            return
        reset_heading = not flags.yaw_align
        self._reset_states(reset_heading=reset_heading)
        aid.time_last_fuse = ekf.time_us
        if reset_heading:
            flags.yaw_align = True
            aid.reset(ekf.time_us)
        flags.mag = True

    def _continue(self, mag: Vector3, variance: float, *, model_new: bool) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        gives_heading = flags.mag_hdg or flags.mag_3d
        if self._climbed_clear() and (gives_heading or flags.yaw_manual):
            self._reset_states(reset_heading=gives_heading and not ekf.north_east_aiding)
            flags.mag_aligned_in_flight = True
            self.aligned_us = aid.time_last_fuse = ekf.time_us
        elif model_new and self._still_or_lost:
            self._reset_states(reset_heading=gives_heading)
            aid.time_last_fuse = ekf.time_us
        else:
            self._fuse(mag, variance, all_states=gives_heading, tilt=flags.mag_3d)
            if flags.mag_dec:
                self._fuse_declination(all_states=gives_heading, tilt=flags.mag_3d)
        if ekf.timed_out(aid.time_last_fuse, RESET_TIMEOUT_US):
            if self._still_or_lost:
                self._reset_states(reset_heading=gives_heading)
                aid.time_last_fuse = ekf.time_us
            else:
                self.stop()

    def _climbed_clear(self) -> bool:
        """In the air for the first time so high that what lies on the ground disturbs no more."""
        ekf, flags = self._ekf, self._ekf.flags
        return flags.in_air and flags.yaw_align and not flags.mag_aligned_in_flight and ekf.hagl_m > ANOMALIES_BELOW_M

    def _fuse(self, mag: Vector3, variance: float, *, all_states: bool, tilt: bool) -> bool:
        """Axis by axis; the heading is turned by no more than a degree a second."""
        ekf, aid, flags = self._ekf, self.aid, self._ekf.flags
        if aid.innovation_rejected:
            return False
        turn_left = 0.0
        if all_states:
            since_s = (ekf.time_us - ekf.heading_fused_us) * 1e-6
            turn_left = LARGEST_TURN_RAD_S * min(max(since_s, 1e-4), 0.2)
        jacobians = [self._jacobian(axis) for axis in range(3)]
        for axis, h in enumerate(jacobians):
            if axis == 2 and flags.synthetic_mag_z:
                continue
            ph, aid.innovation_variance[axis] = ekf.innovation_variance(h, variance)
            if axis:
                aid.innovation[axis] = self._innovation(mag)[axis]
            gain = _masked(ph / aid.innovation_variance[axis], all_states=all_states, tilt=tilt)
            turn = abs(float(gain[cov.YAW]) * aid.innovation[axis])
            if turn > turn_left:
                gain *= turn_left / turn
                turn_left = 0.0
            else:
                turn_left -= turn
            ekf.fuse_by(gain, ph, aid.innovation[axis], aid.innovation_variance[axis])
        aid.fused, aid.time_last_fuse = True, ekf.time_us
        if all_states:
            ekf.heading_fused_us = ekf.time_us
        return True

    def _fuse_declination(self, *, all_states: bool, tilt: bool) -> None:
        ekf, value = self._ekf, self._ekf.settings
        x, y, _ = ekf.state.mag_i
        squared = max(x * x + y * y, 1e-9)
        h = np.zeros(cov.STATES)
        h[cov.MAG_I], h[cov.MAG_I + 1] = -y / squared, x / squared
        ph, innovation_variance = ekf.innovation_variance(h, DECLINATION_VARIANCE)
        declination = self._known_declination(int(value["EKF2_DECL_TYPE"]), value["EKF2_MAG_DECL"])
        if declination is None:  # none is better than nothing, for the field alone (mag_control.cpp)
            declination, all_states, tilt = 0.0, False, False
        gain = _masked(ph / innovation_variance, all_states=all_states, tilt=tilt)
        ekf.fuse_by(gain, ph, wrap_pi(math.atan2(y, x) - declination), innovation_variance)

    # --- resets --------------------------------------------------------------------------------------------

    def _forget_bias(self) -> None:
        cov.uncorrelate(self._ekf.p, cov.MAG_B, (self._ekf.settings["EKF2_MAG_NOISE"] ** 2,) * 3)

    def _forget_field(self) -> None:
        cov.uncorrelate(self._ekf.p, cov.MAG_I, (self._ekf.settings["EKF2_MAG_NOISE"] ** 2,) * 3)

    def _reset_states(self, *, reset_heading: bool) -> None:
        """Field and bias anew: from the model where it is known, else from the sample."""
        ekf, state = self._ekf, self._ekf.state
        ekf.apply()
        if self._model is None:
            state.mag_b = (0.0, 0.0, 0.0)
            self._forget_bias()
            if reset_heading:
                self._reset_heading()
            field = state.to_earth(*self._mean)
            if math.dist(field, state.mag_i) > LEAST_FIELD_CHANGE_GA:
                state.mag_i = field
                self._forget_field()
            return
        changed = math.dist(self._model, state.mag_i) > LEAST_FIELD_CHANGE_GA
        if changed:
            state.mag_i = self._model
            self._forget_field()
        if reset_heading or not ekf.flags.yaw_align:
            state.mag_b = (0.0, 0.0, 0.0)
            self._forget_bias()
        elif changed:
            x, y, z = state.to_body(*self._model)
            state.mag_b = (self._mean[0] - x, self._mean[1] - y, self._mean[2] - z)
            self._forget_bias()
        if reset_heading:
            self._reset_heading()

    def _reset_heading(self) -> None:
        ekf = self._ekf
        reset_yaw(ekf, self._heading_of(self._mean), max(ekf.settings["EKF2_HEAD_NOISE"], 0.01) ** 2)
        self.heading_innovation = 0.0
        ekf.flags.mag_heading_consistent = True

    def stop(self) -> None:
        """The magnetometer is used no more; nor is its heading known any longer, unless aids show it."""
        ekf, flags, faults = self._ekf, self._ekf.flags, self._ekf.faults
        if not flags.mag:
            return
        self._forget_field()
        self._forget_bias()
        if flags.yaw_align and (flags.mag_3d or flags.mag_hdg) and not ekf.north_east_aiding:
            flags.yaw_align = False
        flags.mag = flags.mag_dec = flags.mag_3d = flags.mag_hdg = flags.mag_aligned_in_flight = False
        faults.bad_hdg = faults.bad_mag_x = faults.bad_mag_y = faults.bad_mag_z = faults.bad_mag_decl = False


def _masked(gain: cov.Matrix, *, all_states: bool, tilt: bool) -> cov.Matrix:
    """A gain that corrects field and bias alone, or the heading as well, or the whole attitude."""
    if not all_states:
        masked = np.zeros(cov.STATES)
        masked[cov.MAG_I : cov.WIND] = gain[cov.MAG_I : cov.WIND]
        return masked
    if not tilt:
        gain[0:2] = 0.0
        gain[cov.GYRO_BIAS : cov.GYRO_BIAS + 2] = 0.0
    return gain
