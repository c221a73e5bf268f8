"""What the estimator knows: attitude, height, local and global position (PX4's estimatorCheck).

A position counts while it is fresh and its error stays below COM_POS_FS_EPH (negative: no limit), a velocity below
COM_VEL_FS_EVH; what counted may be two and a half times as far off, and what did not has to be well for a second. One
that counts, but may be further off than COM_POS_LOW_EPH (0 or less: no limit), is a failsafe of its own (failsafe.py).
Before arming, what is measured has to agree with what is estimated: the filter's low-passed test ratios. Its complaints
forbid the modes alone that need an attitude, and those about heading the modes that hold a place.
"""

import math
from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import (
    ALL_MODES,
    NO_MODE,
    Component,
    Findings,
    Notice,
    Settings,
)
from sitl_emu.autopilot.commander.mode_requirements import MODES_THAT_NEED
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.flight_mode import Need
from sitl_emu.autopilot.topics import EstimatorSensorBias, EstimatorStatus, EstimatorStatusFlags, Topics

TIMEOUT_US: Final = 1_000_000
PROBATION_US: Final = 1_000_000
KEPT_FACTOR: Final = 2.5
INFINITE = float("inf")
FLAGS_FRESH_US: Final = 5_000_000
BIAS_FRESH_US: Final = 30_000_000
BIAS_SHARE: Final = 0.75
BIAS_SIGMAS: Final = 3.0
ALMOST_LOST_SHARE: Final = 0.9
ALMOST_LOST_M: Final = 10.0
"""A position is about to be lost this near to what it may be off: the later of the two."""
ATTITUDE_MODES: Final = MODES_THAT_NEED[Need.ATTITUDE]
HEADING_MODES: Final = (
    MODES_THAT_NEED[Need.LOCAL_POSITION] | MODES_THAT_NEED[Need.LOCAL_POSITION_RELAXED] | 1 << NavState.AUTO_TAKEOFF
)
MAG_STRENGTH_DENIES: Final = 1
"""COM_ARM_MAG_STR; 0 looks at nothing, 2 warns."""
LOW_ACCURACY: Final = "check_estimator_low_position_accuracy"
FAILURE_IMMINENT: Final = "check_estimator_position_failure_imminent"
UNSTABLE = (
    ("pre_flt_fail_innov_heading", "heading_not_stable", "heading estimate invalid", HEADING_MODES),
    ("pre_flt_fail_innov_vel_horiz", "hor_vel_not_stable", "horizontal velocity unstable", ATTITUDE_MODES),
    ("pre_flt_fail_innov_vel_vert", "vert_vel_not_stable", "vertical velocity unstable", ATTITUDE_MODES),
    ("pre_flt_fail_innov_pos_horiz", "hor_pos_not_stable", "horizontal position unstable", ATTITUDE_MODES),
    ("pre_flt_fail_innov_height", "hgt_not_stable", "height estimate not stable", ATTITUDE_MODES),
)
"""What the filter finds wrong before flight, the event, the text, the modes; PX4 tells the first."""


class Validity:
    """Whether an estimate may be used, with hysteresis in error and time."""

    def __init__(self) -> None:
        self.valid = False
        self._failed_us = 0

    def update(self, now_us: int, *, valid: bool, timestamp: int, error: float, limit: float) -> bool:
        """Look at the estimate of `timestamp`, which says of itself whether it is valid, and how far off it may be."""
        fresh = timestamp > 0 and now_us <= timestamp + TIMEOUT_US
        allowed = limit * KEPT_FACTOR if self.valid else limit
        if not (valid and fresh and error < allowed):
            self.valid, self._failed_us = False, now_us
        elif now_us > self._failed_us + PROBATION_US:
            self.valid = True
        return self.valid


class EstimatorCheck:
    """Keeps what was valid."""

    def __init__(self) -> None:
        self._global_position, self._local_position, self._local_velocity = Validity(), Validity(), Validity()
        self._global_relaxed, self._local_relaxed = Validity(), Validity()
        self._told_almost_lost = False

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """Flags for what is not valid; an unknown attitude forbids arming."""
        status, armed = topics.estimator_status, topics.vehicle_status.armed
        if not armed:
            _check_innovations(status, findings)
            _check_mag_field(status, settings.com_arm_mag_str, findings)
        _check_flags(now_us, topics, findings)
        _check_attitude(now_us, topics, findings)
        local, position = topics.vehicle_local_position, topics.vehicle_global_position
        limit_m = settings.com_pos_fs_eph_m if settings.com_pos_fs_eph_m >= 0.0 else INFINITE
        xy_valid, v_xy_valid = local.xy_valid, local.v_xy_valid
        if not armed:
            xy_valid = xy_valid and not status.pre_flt_fail_innov_pos_horiz
            v_xy_valid = v_xy_valid and not status.pre_flt_fail_innov_vel_horiz
        findings.global_position_invalid = not self._global_position.update(
            now_us, valid=position.valid, timestamp=position.timestamp, error=position.eph, limit=limit_m
        )
        findings.global_position_invalid_relaxed = not self._global_relaxed.update(
            now_us, valid=position.valid, timestamp=position.timestamp, error=position.eph, limit=INFINITE
        )
        self._check_dead_reckoning(now_us, topics, limit_m, findings)
        findings.local_position_invalid = not self._local_position.update(
            now_us, valid=xy_valid, timestamp=local.timestamp, error=local.eph, limit=limit_m
        )
        findings.local_position_invalid_relaxed = not self._local_relaxed.update(
            now_us, valid=xy_valid, timestamp=local.timestamp, error=local.eph, limit=INFINITE
        )
        findings.local_velocity_invalid = not self._local_velocity.update(
            now_us, valid=v_xy_valid, timestamp=local.timestamp, error=local.evh, limit=settings.com_vel_fs_evh_m_s
        )
        findings.local_altitude_invalid = not (local.z_valid and now_us <= local.timestamp + TIMEOUT_US)
        if not (findings.global_position_invalid and findings.local_position_invalid):
            findings.position_accuracy_low = 0.0 < settings.com_pos_low_eph_m < local.eph
        if findings.position_accuracy_low and settings.com_pos_low_act and armed:
            failure = ALL_MODES, Component.LOCAL_POSITION_ESTIMATE, Severity.ERROR, LOW_ACCURACY
            text = "Position estimate has low accuracy\t"
            findings.arming_check_failure(*failure, text=text, said_as=Severity.WARNING)

    def _check_dead_reckoning(self, now_us: int, topics: Topics, limit_m: float, findings: Findings) -> None:
        """Told once: a position that nothing measures will not be one for long."""
        flags, kept_m = topics.estimator_status_flags, KEPT_FACTOR * limit_m
        if not flags.timestamp or now_us - flags.timestamp >= FLAGS_FRESH_US:
            return
        almost_m = max(ALMOST_LOST_SHARE * kept_m, kept_m - ALMOST_LOST_M)
        if not (flags.cs_inertial_dead_reckoning or flags.cs_wind_dead_reckoning):
            self._told_almost_lost = False
        elif (
            not (findings.global_position_invalid or self._told_almost_lost)
            and topics.vehicle_global_position.eph > almost_m
        ):
            self._told_almost_lost = True
            findings.notices.append(Notice(FAILURE_IMMINENT, Severity.ERROR))


def _check_attitude(now_us: int, topics: Topics, findings: Findings) -> None:
    attitude = topics.vehicle_attitude
    if not attitude.timestamp or now_us > attitude.timestamp + TIMEOUT_US:
        findings.attitude_invalid = True
    if topics.estimator_status.timestamp:
        findings.health_present |= Component.LOCAL_POSITION_ESTIMATE
        _check_biases(now_us, topics.estimator_sensor_bias, findings)
        return
    failure = (ATTITUDE_MODES, Component.LOCAL_POSITION_ESTIMATE, Severity.INFO, "check_estimator_missing_data")
    findings.arming_check_failure(*failure, text="Preflight Fail: ekf2 missing data")


def _check_biases(now_us: int, bias: EstimatorSensorBias, findings: Findings) -> None:
    """Three quarters of what a bias may be (EKF2_ABL_LIM, EKF2_ABL_GYRLIM), beyond doubt, are too much."""
    if not bias.timestamp or now_us - bias.timestamp >= BIAS_FRESH_US:
        return
    sensors = (
        (
            "accel",
            "Accelerometer",
            bias.accel_bias_valid,
            bias.accel_bias,
            bias.accel_bias_limit,
            bias.accel_bias_variance,
        ),
        ("gyro", "Gyro", bias.gyro_bias_valid, bias.gyro_bias, bias.gyro_bias_limit, bias.gyro_bias_variance),
    )
    for sensor, name, valid, values, limit, variances in sensors:
        for axis, (value, variance) in enumerate(zip(values, variances, strict=True)):
            least, doubt = BIAS_SHARE * limit, BIAS_SIGMAS * math.sqrt(max(0.0, variance))
            if valid and abs(value) > least + doubt:
                component, event = Component.LOCAL_POSITION_ESTIMATE, f"check_estimator_high_{sensor}_bias"
                told = (axis, value, least, doubt)
                text = f"Preflight Fail: High {name} Bias"
                findings.arming_check_failure(ATTITUDE_MODES, component, Severity.ERROR, event, *told, text=text)
                return


def _check_innovations(status: EstimatorStatus, findings: Findings) -> None:
    for name, event, text, modes in UNSTABLE:
        if getattr(status, name):
            failure = (modes, Component.LOCAL_POSITION_ESTIMATE, Severity.ERROR, f"check_estimator_{event}")
            findings.arming_check_failure(*failure, text=f"Preflight Fail: {text}")
            return


def _check_mag_field(status: EstimatorStatus, com_arm_mag_str: int, findings: Findings) -> None:
    """Another field than the earth's at this place (EKF2_MAG_CHECK)."""
    if com_arm_mag_str < MAG_STRENGTH_DENIES or not status.pre_flt_fail_mag_field_disturbed:
        return
    modes = ATTITUDE_MODES if com_arm_mag_str == MAG_STRENGTH_DENIES else NO_MODE
    event, text = "check_estimator_mag_interference", "Preflight Fail: Strong magnetic interference"
    measured = (status.mag_strength_gs, status.mag_strength_ref_gs)
    inclined = (status.mag_inclination_deg, status.mag_inclination_ref_deg)
    component = Component.LOCAL_POSITION_ESTIMATE
    findings.arming_check_failure(modes, component, Severity.WARNING, event, *measured, *inclined, text=text)


def _check_flags(now_us: int, topics: Topics, findings: Findings) -> None:
    """A compass that disagrees with everything else has to be calibrated, in flight as well; heading needs a source."""
    flags: EstimatorStatusFlags = topics.estimator_status_flags
    if flags.cs_mag_fault:
        failure = (ALL_MODES, Component.LOCAL_POSITION_ESTIMATE, Severity.CRITICAL, "check_estimator_mag_fault")
        findings.arming_check_failure(*failure, text="Compass needs calibration - Land now!\t")
    fresh = flags.timestamp > 0 and now_us - flags.timestamp < FLAGS_FRESH_US
    placed = topics.vehicle_local_position.xy_global
    if fresh and placed and not (topics.vehicle_status.armed or flags.cs_yaw_align):
        event, text = "check_estimator_heading_no_source", "Preflight Fail: no heading reference"
        heading = (HEADING_MODES, Component.LOCAL_POSITION_ESTIMATE, Severity.ERROR, event)
        findings.arming_check_failure(*heading, text=text)
