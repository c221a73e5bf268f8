"""GPS: a 3D fix that is not old (the GPS half of PX4's estimatorCheck).

Whether a vehicle may arm without GPS is COM_ARM_WO_GPS: 0 forbids it, 1 tells, 2 says nothing.
"""

from autopilot.commander.arming_checks.findings import ALL_MODES, GPS, NO_MODE, Component, Findings, Settings
from autopilot.constants import Severity
from autopilot.topics import Topics

TIMEOUT_US = 2_000_000
FIX_3D = 3
TOLD = "Preflight: GPS fix too low"
EVENT = "check_estimator_gps_fix_too_low"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A poor fix is told on the ground; it, or no GPS at all, forbids arming where COM_ARM_WO_GPS says so."""
    gps = topics.sensor_gps
    if not settings.sys_has_gps:
        return
    if topics.estimator_status.gps_fused:
        findings.health_present |= Component.GPS
    lost = gps.timestamp == 0 or now_us - gps.timestamp > TIMEOUT_US
    if not lost and gps.fix_type >= FIX_3D:
        return
    if lost:
        findings.unhealthy |= GPS
    if topics.vehicle_status.armed:
        return
    if settings.com_arm_wo_gps == 0:
        text = TOLD.replace("Preflight:", "Preflight Fail:")
        findings.arming_check_failure(ALL_MODES, Component.GPS, Severity.ERROR, EVENT, text=text)
    elif settings.com_arm_wo_gps == 1:
        findings.arming_check_failure(NO_MODE, Component.GPS, Severity.WARNING, EVENT, text="" if lost else TOLD)
