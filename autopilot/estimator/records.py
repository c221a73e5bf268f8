"""What the filter tells of itself: records for the log, for checks and for ground stations.

PX4's EKF2 (EKF2.cpp: PublishStatus, PublishStatusFlags, PublishStates, PublishInnovations, …, v1.18), which publishes
most of them with every step. So do we while a log takes them; else those that change at every step are written two to
ten times a second, for nobody else looks more often.
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource, record_1d, record_2d, record_3d
from sitl_emu.autopilot.estimator.bias_estimator import BiasStatus
from sitl_emu.autopilot.estimator.ekf import ACCEL_BIAS, GYRO_BIAS, Ekf
from sitl_emu.autopilot.estimator.flags import FAULT_NAMES, ControlStatus, control_flags, fault_flags, mask
from sitl_emu.autopilot.estimator.fusion import Fusion
from sitl_emu.autopilot.estimator.publication import Publication
from sitl_emu.autopilot.estimator.stable_bias import StableBias
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    EstimatorBias,
    EstimatorEventFlags,
    EstimatorFusionControl,
    EstimatorGpsStatus,
    EstimatorInnovations,
    EstimatorSensorBias,
    EstimatorStates,
    EstimatorStatus,
    EstimatorStatusFlags,
    Topics,
    Vector3,
)

OFTEN_US: Final = 100_000
HALF_US: Final = 500_000
SELDOM_US: Final = 1_000_000
LEAST_PREFLIGHT_RATIO: Final = 0.5
BIAS_CHANGE: Final = 1e-3
HEIGHT_BIAS_CHANGE_M: Final = 1e-6
"""Biases that have changed by less are not told again."""
VALID_VARIANCE: Final = 0.1
MAG_VARIANCE: Final = 0.02
MAG_BIAS_LIMIT_GA: Final = 0.5
AIRSPEED: Final = 1 << 11
RANGING_BEACON: Final = 1 << 12
"""MAV_CMD_ESTIMATOR_SENSOR_ENABLE's sources that no vehicle of ours has."""
ACCEL_DEVICE, GYRO_DEVICE = DEVICE_IDS["ACC"], DEVICE_IDS["GYRO"]
BARO_DEVICE, MAG_DEVICE = DEVICE_IDS["BARO"], DEVICE_IDS["MAG"]
GYRO: Final = 0
ACCEL: Final = 1
MAG: Final = 2
"""Places in what is learnt of biases."""
UNNAMED_FAULT = FAULT_NAMES.index("unused")
EVENT_NAMES = EstimatorEventFlags._fields[3:]
ATTITUDE: Final = 1
VELOCITY_HORIZ: Final = 2
VELOCITY_VERT: Final = 4
POS_HORIZ_REL: Final = 8
POS_HORIZ_ABS: Final = 16
POS_VERT_ABS: Final = 32
POS_VERT_AGL: Final = 64
CONST_POS_MODE: Final = 128
PRED_POS_HORIZ_REL: Final = 256
PRED_POS_HORIZ_ABS: Final = 512
GPS_GLITCH: Final = 1024
ACCEL_ERROR: Final = 2048
"""ESTIMATOR_STATUS_FLAGS."""


class Records:
    """Writer of all estimator_* topics and yaw_estimator_status."""

    def __init__(self, topics: Topics, fusion: Fusion, publication: Publication) -> None:
        self._topics, self._fusion, self._ekf = topics, fusion, fusion.ekf
        self._publication = publication
        self.logged = False
        """Whether a log takes them."""
        self._often_us = self._half_us = self._seldom_us = self._bias_us = self._event_us = 0
        self._flags: tuple[bool, ...] = ()
        self._faults = fault_flags(fusion.ekf.faults)
        self._masks = 0, mask(self._faults)
        self._flag_changes = self._fault_changes = self._event_changes = 0
        self._biases: tuple[Vector3, Vector3, Vector3] = (NAN3, NAN3, NAN3)
        self._baro_bias_m = self._gnss_hgt_bias_m = 0.0
        """As told last; 0 before, so that a sensor without a bias tells of none."""
        self._gps_sample_us = self._steps = 0
        self._stable = (StableBias(), StableBias(), StableBias())
        """Of gyro, accelerometer and magnetometer."""
        self._was_in_air = True
        self._seen = [0] * 15

    def update(self, now_us: int) -> None:
        """After a step of the filter."""
        ekf, fusion = self._ekf, self._fusion
        self._steps += 1
        logged = self.logged
        if self._steps & 1 and not logged:
            return  # no sensor has two samples in two steps
        self._aid_sources(now_us)
        if ekf.events:
            self._event_flags(now_us)
        sample = fusion.gnss.sample
        if sample is not None and sample.time_us != self._gps_sample_us:
            self._gps_sample_us = sample.time_us
            self._gps_status(now_us)
        often = now_us >= self._often_us
        if not (often or logged):
            return
        topics = self._topics
        flags, faults = control_flags(ekf.flags), fault_flags(ekf.faults)
        if (flags, faults) != (self._flags, self._faults):
            self._masks = mask(flags), mask(faults)
        self._status(now_us, *self._masks)
        self._status_flags(now_us, flags, faults)
        if often:
            self._often_us = now_us + OFTEN_US
            self._look_at_biases(now_us)
            self._publication.wind(now_us)
        self._sensor_bias(now_us)
        if logged or now_us >= self._half_us:
            self._half_us = now_us + HALF_US
            topics.estimator_states = _states(ekf, now_us)
            self._innovations(now_us)
            topics.estimator_fusion_control = _fusion_control(fusion, now_us)
        if fusion.gnss.yaw_estimator.active:
            topics.yaw_estimator_status = fusion.gnss.yaw_estimator.record(now_us, ekf.time_us)
        if self._event_us and now_us >= self._event_us + SELDOM_US:
            self._event_us = now_us
            topics.estimator_event_flags = topics.estimator_event_flags._replace(timestamp=now_us)

    def forget(self, sensor: int) -> None:
        """GYRO, ACCEL or MAG is another one, or calibrated anew: nothing of its bias has been learnt."""
        self._stable[sensor].restart()

    # --- each sample ---------------------------------------------------------------------------------------

    def _aid_sources(self, now_us: int) -> None:
        fusion, topics, new = self._fusion, self._topics, self._new
        if new(0, fusion.baro.aid):
            topics.estimator_aid_src_baro_hgt = record_1d(fusion.baro.aid, now_us, BARO_DEVICE)
            status = self._ekf.baro_bias.status
            if abs(status.bias - self._baro_bias_m) > HEIGHT_BIAS_CHANGE_M:
                self._baro_bias_m = status.bias
                topics.estimator_baro_bias = _bias(status, now_us, fusion.baro.aid.timestamp_sample, BARO_DEVICE)
        if new(1, fusion.magnetometer.aid):
            topics.estimator_aid_src_mag = record_3d(fusion.magnetometer.aid, now_us, MAG_DEVICE)
        if new(2, fusion.range.aid):
            topics.estimator_aid_src_rng_hgt = record_1d(fusion.range.aid, now_us)
        if new(3, fusion.gnss.pos):
            topics.estimator_aid_src_gnss_pos = record_2d(fusion.gnss.pos, now_us)
            topics.estimator_aid_src_gnss_vel = record_3d(fusion.gnss.vel, now_us)
        if new(4, fusion.gnss_height.aid):
            topics.estimator_aid_src_gnss_hgt = record_1d(fusion.gnss_height.aid, now_us)
            status = self._ekf.gnss_hgt_bias.status
            if abs(status.bias - self._gnss_hgt_bias_m) > HEIGHT_BIAS_CHANGE_M:
                self._gnss_hgt_bias_m = status.bias
                topics.estimator_gnss_hgt_bias = _bias(status, now_us, fusion.gnss_height.aid.timestamp_sample, 0)
        if new(5, fusion.gravity.aid):
            topics.estimator_aid_src_gravity = record_3d(fusion.gravity.aid, now_us)
        if new(6, fusion.fake_position.aid):
            topics.estimator_aid_src_fake_pos = record_2d(fusion.fake_position.aid, now_us)
        if new(7, fusion.fake_height.aid):
            topics.estimator_aid_src_fake_hgt = record_1d(fusion.fake_height.aid, now_us)
        if fusion.vision.buffer.pushed_us:
            self._vision(now_us)
        if fusion.flow.buffer.pushed_us and new(12, fusion.flow.aid):
            topics.estimator_aid_src_optical_flow = record_2d(fusion.flow.aid, now_us)
        if fusion.drag.buffer.pushed_us and new(13, fusion.drag.aid):
            topics.estimator_aid_src_drag = record_2d(fusion.drag.aid, now_us)

    def _vision(self, now_us: int) -> None:
        vision, topics, new = self._fusion.vision, self._topics, self._new
        if new(8, vision.yaw.aid):
            topics.estimator_aid_src_ev_yaw = record_1d(vision.yaw.aid, now_us)
        if new(9, vision.vel.aid):
            topics.estimator_aid_src_ev_vel = record_3d(vision.vel.aid, now_us)
        if new(10, vision.pos.aid):
            topics.estimator_aid_src_ev_pos = record_2d(vision.pos.aid, now_us)
        if new(11, vision.height.aid):
            topics.estimator_aid_src_ev_hgt = record_1d(vision.height.aid, now_us)

    def _new(self, slot: int, aid: AidSource) -> bool:
        if aid.generation == self._seen[slot]:
            return False
        self._seen[slot] = aid.generation
        return True

    def _event_flags(self, now_us: int) -> None:
        ekf = self._ekf
        self._event_changes += 1
        self._event_us = now_us
        happened = (name in ekf.events for name in EVENT_NAMES)
        self._topics.estimator_event_flags = EstimatorEventFlags(now_us, ekf.time_us, self._event_changes, *happened)
        ekf.events.clear()

    def _gps_status(self, now_us: int) -> None:
        checks = self._fusion.gnss.checks
        failed = checks.failures
        self._topics.estimator_gps_status = EstimatorGpsStatus(
            now_us, self._gps_sample_us, checks.passed, failed.fix, failed.nsats, failed.pdop, failed.hacc, failed.vacc,
            failed.sacc, failed.hdrift, failed.vdrift, failed.hspeed, failed.vspeed, failed.spoofed,
            checks.drift_horizontal_m_s, checks.drift_vertical_m_s, checks.speed_horizontal_m_s,
        )  # fmt: skip

    # --- each step, or ten times a second --------------------------------------------------------------------

    def _status(self, now_us: int, flags: int, faults: int) -> None:
        ekf, fusion = self._ekf, self._fusion
        magnetometer, resets = fusion.magnetometer, ekf.resets
        vel_xy, vel_z = _velocity_ratios(fusion)
        velocity = max((ratio for ratio in (vel_xy, vel_z) if ratio == ratio), default=NAN)
        heading, position, height = _heading_ratio(fusion), _position_ratio(fusion), _height_ratio(fusion)
        eph, epv, _, _ = self._publication.accuracies()
        enabled = int(ekf.settings["EKF2_GPS_CHECK"]) << 1 | 1
        least = LEAST_PREFLIGHT_RATIO
        self._topics.estimator_status = EstimatorStatus(
            now_us, ekf.time_us, ekf.output.tracking_error, fusion.gnss.checks.failures.mask() & enabled, flags, faults,
            eph, epv, heading, velocity, position, height, NAN, _hagl_ratio(fusion), NAN, _solution(fusion),
            resets.vel_ne & 255, resets.vel_d & 255, resets.pos_ne & 255, resets.pos_d & 255, resets.quat & 255, 0.0,
            heading > least, height > least, position > least, vel_xy > least, vel_z > least,
            ekf.flags.mag_field_disturbed, ACCEL_DEVICE, GYRO_DEVICE, BARO_DEVICE, MAG_DEVICE, 0, 0,
            math.degrees(magnetometer.measured_inclination_rad), math.degrees(magnetometer.inclination_rad),
            magnetometer.measured_strength_ga, magnetometer.strength_ga,
        )  # fmt: skip

    def _status_flags(self, now_us: int, flags: tuple[bool, ...], faults: tuple[bool, ...]) -> None:
        ekf = self._ekf
        if (flags, faults) == (self._flags, self._faults) and now_us < self._seldom_us:
            return
        self._flag_changes += flags != self._flags
        self._fault_changes += faults != self._faults
        self._flags, self._faults, self._seldom_us = flags, faults, now_us + SELDOM_US
        # The message leaves out the last of the ones, and what has no name among the others.
        named = faults[:UNNAMED_FAULT] + faults[UNNAMED_FAULT + 1 :]
        self._topics.estimator_status_flags = EstimatorStatusFlags._make(
            (now_us, ekf.time_us, self._flag_changes, *flags[:-1], self._fault_changes, *named)
        )

    def _innovations(self, now_us: int) -> None:
        topics, fusion, horizon_us, flags = self._topics, self._fusion, self._ekf.time_us, self._ekf.flags
        gnss, vision, magnetometer = fusion.gnss, fusion.vision, fusion.magnetometer
        vel, pos, height, baro, ranged = gnss.vel, gnss.pos, fusion.gnss_height.aid, fusion.baro.aid, fusion.range.aid
        ev_vel, ev_pos, ev_height, ev_yaw = vision.vel.aid, vision.pos.aid, vision.height.aid, vision.yaw.aid
        flow, mag, gravity, drag = fusion.flow.aid, magnetometer.aid, fusion.gravity.aid, fusion.drag.aid
        consistency, by_mag = fusion.range.sensor.consistency, flags.mag_hdg or flags.mag_3d
        topics.estimator_innovations = _innovations(
            now_us, horizon_us, vel.innovation, pos.innovation, height.innovation, ev_vel.innovation,
            ev_pos.innovation, ev_height.innovation, ranged.innovation, baro.innovation, flow.innovation,
            _heading(flags, ev_yaw.innovation, max(mag.innovation) if by_mag else magnetometer.heading_innovation),
            mag.innovation, gravity.innovation, drag.innovation, consistency.innovation,
        )  # fmt: skip
        topics.estimator_innovation_variances = _innovations(
            now_us, horizon_us, vel.innovation_variance, pos.innovation_variance, height.innovation_variance,
            ev_vel.innovation_variance, ev_pos.innovation_variance, ev_height.innovation_variance,
            ranged.innovation_variance, baro.innovation_variance, flow.innovation_variance,
            _heading(flags, ev_yaw.innovation_variance, max(mag.innovation_variance) if by_mag else 0.0),
            mag.innovation_variance, gravity.innovation_variance, drag.innovation_variance,
            consistency.innovation_variance,
        )  # fmt: skip
        topics.estimator_innovation_test_ratios = _innovations(
            now_us, horizon_us, vel.test_ratio, pos.test_ratio, height.test_ratio, ev_vel.test_ratio,
            ev_pos.test_ratio, ev_height.test_ratio, ranged.test_ratio, baro.test_ratio, flow.test_ratio,
            _heading(flags, ev_yaw.test_ratio, max(mag.test_ratio) if by_mag else 0.0),
            mag.test_ratio, gravity.test_ratio, drag.test_ratio, consistency.test_ratio_filtered,
        )  # fmt: skip

    def _look_at_biases(self, now_us: int) -> None:
        """Which biases are stable, as EKF2.cpp's UpdateGyroCalibration and its likes see it."""
        ekf, flags, state = self._ekf, self._ekf.flags, self._ekf.state
        if flags.in_air and not self._was_in_air:
            for stable in self._stable:
                stable.restart()
        self._was_in_air = flags.in_air
        control, healthy = int(ekf.settings["EKF2_IMU_CTRL"]), True not in fault_flags(ekf.faults)
        variances = ekf.p.diagonal().tolist()
        mag_x, mag_y, mag_z = variances[cov.MAG_B : cov.WIND]
        mag_known = flags.yaw_align and 0.0 < math.hypot(mag_x, mag_y, mag_z) <= MAG_VARIANCE
        learnt = (
            (cov.GYRO_BIAS, state.gyro_bias, ekf.settings["EKF2_GYR_B_LIM"],
             bool(control & GYRO_BIAS) and flags.tilt_align, not ekf.gyro_inhibited),
            (cov.ACCEL_BIAS, state.accel_bias, ekf.settings["EKF2_ABL_LIM"],
             bool(control & ACCEL_BIAS) and flags.tilt_align, True not in ekf.accel_inhibited),
            (cov.MAG_B, state.mag_b, MAG_BIAS_LIMIT_GA, mag_known, flags.mag),
        )  # fmt: skip
        for stable, (first, bias, limit, valid, learning) in zip(self._stable, learnt, strict=True):
            x, y, z = variances[first : first + 3]
            stable.update(now_us, bias, (x, y, z), limit, valid=valid and healthy, learning=learning)

    def _sensor_bias(self, now_us: int) -> None:
        state = self._ekf.state
        if now_us < self._bias_us:
            gyro_told, accel_told, mag_told = self._biases
            if (
                math.dist(state.gyro_bias, gyro_told) <= BIAS_CHANGE
                and math.dist(state.accel_bias, accel_told) <= BIAS_CHANGE
                and math.dist(state.mag_b, mag_told) <= BIAS_CHANGE
            ):
                return
        self._bias_us, self._biases = now_us + SELDOM_US, (state.gyro_bias, state.accel_bias, state.mag_b)
        gyro, accel, mag = self._stable
        self._topics.estimator_sensor_bias = _sensor_bias(self._ekf, now_us, (gyro.stable, accel.stable, mag.stable))


def _states(ekf: Ekf, now_us: int) -> EstimatorStates:
    state = ekf.state
    states = (
        *state.q, state.vn, state.ve, state.vd, 0.0, 0.0, -state.alt, *state.gyro_bias, *state.accel_bias,
        *state.mag_i, *state.mag_b, *state.wind, state.terrain,
    )  # fmt: skip
    return EstimatorStates(now_us, ekf.time_us, states, len(states), tuple(ekf.p.diagonal().tolist()))


def _bias(status: BiasStatus, now_us: int, sample_us: int, device_id: int) -> EstimatorBias:
    return EstimatorBias(now_us, sample_us, device_id, *status)


def _sensor_bias(ekf: Ekf, now_us: int, stable: tuple[bool, bool, bool]) -> EstimatorSensorBias:
    value, state = ekf.settings, ekf.state
    control = int(value["EKF2_IMU_CTRL"])
    variances = ekf.p.diagonal().tolist()
    told: list[object] = []
    parts = (
        (cov.GYRO_BIAS, GYRO_DEVICE, state.gyro_bias, value["EKF2_GYR_B_LIM"], bool(control & GYRO_BIAS)),
        (cov.ACCEL_BIAS, ACCEL_DEVICE, state.accel_bias, value["EKF2_ABL_LIM"], bool(control & ACCEL_BIAS)),
        (cov.MAG_B, MAG_DEVICE, state.mag_b, MAG_BIAS_LIMIT_GA, True),
    )
    for (first, device, bias, limit, wanted), is_stable in zip(parts, stable, strict=True):
        spread = tuple(variances[first : first + 3])
        valid = 0.0 < math.hypot(*spread) <= VALID_VARIANCE
        nothing: list[object] = [0, (0.0,) * 3, 0.0, (0.0,) * 3, False, False]
        told += [device, bias, limit, spread, valid, is_stable] if wanted else nothing
    return EstimatorSensorBias._make((now_us, ekf.time_us, *told))


def _fusion_control(fusion: Fusion, now_us: int) -> EstimatorFusionControl:
    flags, value, sens_en = fusion.ekf.flags, fusion.ekf.settings, fusion.ekf.sens_en
    return EstimatorFusionControl(
        now_us,
        gps_intended=(fusion.gnss.intended, False),
        of_intended=fusion.flow.intended,
        ev_intended=fusion.vision.intended,
        agp_intended=fusion.auxiliary.intended(),
        baro_intended=fusion.baro.intended,
        rng_intended=fusion.range.intended,
        mag_intended=fusion.magnetometer.intended,
        aspd_intended=value["EKF2_ARSP_THR"] > 0.0 and bool(sens_en & AIRSPEED),
        rngbcn_intended=bool(int(value["EKF2_RNGBC_CTRL"])) and bool(sens_en & RANGING_BEACON),
        gps_active=(flags.gnss_pos or flags.gps_hgt or flags.gnss_vel, False),
        of_active=flags.opt_flow,
        ev_active=flags.ev_pos or flags.ev_hgt or flags.ev_vel or flags.ev_yaw,
        agp_active=fusion.auxiliary.active(),
        baro_active=flags.baro_hgt,
        rng_active=flags.rng_hgt,
        mag_active=flags.mag,
    )


def _heading(flags: ControlStatus, ev_yaw: list[float], by_mag: float) -> float:
    return ev_yaw[0] if flags.ev_yaw else by_mag


def _innovations(
    now_us: int,
    horizon_us: int,
    gps: list[float],
    gps_pos: list[float],
    gps_height: list[float],
    ev: list[float],
    ev_pos: list[float],
    ev_height: list[float],
    hagl: list[float],
    baro: list[float],
    flow: list[float],
    heading: float,
    mag: list[float],
    gravity: list[float],
    drag: list[float],
    hagl_rate: float,
) -> EstimatorInnovations:
    """Of each aid its innovations, their variances, or their test ratios."""
    return EstimatorInnovations(
        now_us, horizon_us, (gps[0], gps[1]), gps[2], (gps_pos[0], gps_pos[1]), gps_height[0], (ev[0], ev[1]), ev[2],
        (ev_pos[0], ev_pos[1]), ev_height[0], hagl[0], baro[0], (0.0, 0.0), (flow[0], flow[1]), heading,
        (mag[0], mag[1], mag[2]), (gravity[0], gravity[1], gravity[2]), (drag[0], drag[1]), 0.0, 0.0, hagl[0],
        hagl_rate,
    )  # fmt: skip


# --- test ratios: NaN where nothing of the kind aids ---------------------------------------------------------


def _velocity_ratios(fusion: Fusion) -> tuple[float, float]:
    """Of the horizontal and the vertical velocity."""
    flags, xy, z = fusion.ekf.flags, -1.0, -1.0
    if flags.gnss_vel:
        xy, z = fusion.gnss.vel.largest_ratio(2), abs(fusion.gnss.vel.test_ratio_filtered[2])
    if flags.ev_vel:
        aid = fusion.vision.vel.aid
        xy, z = max(xy, aid.largest_ratio(2)), max(z, abs(aid.test_ratio_filtered[2]))
    if flags.opt_flow and not fusion.ekf.flags.other_horizontal_aid(True):
        xy = max(xy, fusion.flow.aid.largest_ratio())
    return _root(xy), _root(z)


def _position_ratio(fusion: Fusion) -> float:
    flags, ratio = fusion.ekf.flags, -1.0
    if flags.gnss_pos:
        ratio = fusion.gnss.pos.largest_ratio()
    if flags.ev_pos:
        ratio = max(ratio, fusion.vision.pos.aid.largest_ratio())
    if flags.aux_gpos:
        ratio = max(ratio, fusion.auxiliary.largest_ratio())
    return _root(ratio)


def _height_ratio(fusion: Fusion) -> float:
    """Mean of those that aid."""
    flags = fusion.ekf.flags
    in_use = (
        (flags.baro_hgt, fusion.baro.aid),
        (flags.gps_hgt, fusion.gnss_height.aid),
        (flags.rng_hgt, fusion.range.aid),
        (flags.ev_hgt, fusion.vision.height.aid),
    )
    roots = [math.sqrt(aid.largest_ratio()) for used, aid in in_use if used]
    return sum(roots) / len(roots) if roots else NAN


def _heading_ratio(fusion: Fusion) -> float:
    flags, ratio = fusion.ekf.flags, -1.0
    if flags.mag_hdg or flags.mag_3d:
        ratio = fusion.magnetometer.aid.largest_ratio()
    if flags.ev_yaw:
        ratio = max(ratio, fusion.vision.yaw.aid.largest_ratio())
    return _root(ratio)


def _hagl_ratio(fusion: Fusion) -> float:
    flags, roots = fusion.ekf.flags, []
    if flags.opt_flow_terrain:
        roots.append(math.sqrt(fusion.flow.aid.largest_ratio()))
    if flags.rng_terrain:
        roots.append(math.sqrt(fusion.range.aid.largest_ratio()))
    return sum(roots) / len(roots) if roots else NAN


def _root(ratio: float) -> float:
    return math.sqrt(ratio) if ratio >= 0.0 else NAN


def _solution(fusion: Fusion) -> int:
    """ESTIMATOR_STATUS_FLAGS."""
    ekf, flags = fusion.ekf, fusion.ekf.flags
    horizontal = ekf.local_horizontal_valid
    vertical = ekf.local_vertical_valid or not ekf.vertical_velocity_dead_reckoning_too_long
    glitch = max(*fusion.gnss.vel.test_ratio, *fusion.gnss.pos.test_ratio) > 1.0
    bits = (
        (ATTITUDE, flags.tilt_align),
        (VELOCITY_HORIZ | POS_HORIZ_REL, horizontal),
        (VELOCITY_VERT, vertical),
        (POS_HORIZ_ABS, horizontal and ekf.origin is not None),
        (POS_VERT_ABS, ekf.flags.vertical_aiding),
        (POS_VERT_AGL, ekf.hagl_valid),
        (CONST_POS_MODE, flags.fake_pos or flags.valid_fake_pos or flags.vehicle_at_rest),
        (PRED_POS_HORIZ_REL, ekf.flags.horizontal_aiding),
        (PRED_POS_HORIZ_ABS, flags.gnss_pos or flags.aux_gpos),
        (GPS_GLITCH, glitch),
        (ACCEL_ERROR, ekf.faults.bad_acc_vertical or ekf.faults.bad_acc_clipping),
    )
    return sum(bit for bit, is_set in bits if is_set)
