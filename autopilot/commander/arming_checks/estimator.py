"""What the estimator knows: attitude, height, local and global position (PX4's estimatorCheck).

A position counts while it is fresh and its error stays below COM_POS_FS_EPH (horizontally; 0 and less: no limit).
"""

from autopilot.commander.arming_checks.findings import AHRS, ALL_MODES, Component, Findings, Settings
from autopilot.constants import Severity
from autopilot.topics import Topics

TIMEOUT_US = 1_000_000
UNSTABLE_US = 2_500_000
"""The GPS has told something else for so long: ours, in place of the innovation filters of EKF2 (ekf2/EKF2.cpp)."""


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Flags for what is not valid; no attitude forbids arming."""
    attitude = topics.vehicle_attitude
    status = topics.estimator_status
    if now_us - attitude.timestamp > TIMEOUT_US or not status.tilt_aligned or not status.yaw_aligned:
        findings.attitude_invalid = True
        findings.unhealthy |= AHRS
        text = "Preflight Fail: Attitude estimate not valid"
        failure = (ALL_MODES, Component.LOCAL_POSITION_ESTIMATE, Severity.INFO, "check_estimator_missing_data")
        findings.arming_check_failure(*failure, text=text)
    else:
        findings.health_present |= Component.LOCAL_POSITION_ESTIMATE
    rejected_us = now_us - status.horizontal_good_us
    if status.gps_fused and rejected_us > UNSTABLE_US and not topics.vehicle_status.armed:
        text = "Preflight Fail: horizontal position unstable"
        failure = (ALL_MODES, Component.LOCAL_POSITION_ESTIMATE, Severity.ERROR, "check_estimator_hor_pos_not_stable")
        findings.arming_check_failure(*failure, text=text)
    local = topics.vehicle_local_position
    fresh = local.timestamp > 0 and now_us - local.timestamp < TIMEOUT_US
    too_far_off = 0.0 < settings.com_pos_fs_eph_m < local.eph
    findings.local_altitude_invalid = not (fresh and local.z_valid)
    findings.local_velocity_invalid = not (fresh and local.v_xy_valid)
    findings.local_position_invalid_relaxed = not (fresh and local.xy_valid)
    findings.local_position_invalid = findings.local_position_invalid_relaxed or too_far_off
    position = topics.vehicle_global_position
    findings.global_position_invalid_relaxed = (
        not position.valid or now_us - position.timestamp > TIMEOUT_US or findings.local_position_invalid_relaxed
    )
    findings.global_position_invalid = findings.global_position_invalid_relaxed or too_far_off
