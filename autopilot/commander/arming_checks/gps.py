"""GPS: is its fix good enough? (the GPS half of PX4's estimatorCheck).

A GPS that has fallen silent is no poor GPS: PX4 says nothing of it. What the estimator then no longer knows denies
arming. Whether a vehicle may arm with a poor fix is COM_ARM_WO_GPS: 0 forbids it, 1 tells, 2 says nothing.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

FIX_3D: Final = 3
GNSS_POS: Final = 1 << 2
"""Bit of estimator_status.control_mode_flags."""
TOLD: Final = "Preflight: GPS fix too low"
EVENT: Final = "check_estimator_gps_fix_too_low"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A poor fix is told on the ground, and forbids arming where COM_ARM_WO_GPS says so."""
    gps = topics.sensor_gps
    if not settings.sys_has_gps:
        return
    if topics.estimator_status.control_mode_flags & GNSS_POS:
        findings.health_present |= Component.GPS
    if gps.timestamp == 0 or gps.fix_type >= FIX_3D or topics.vehicle_status.armed:
        return
    if settings.com_arm_wo_gps == 0:
        text = TOLD.replace("Preflight:", "Preflight Fail:")
        findings.arming_check_failure(ALL_MODES, Component.GPS, Severity.ERROR, EVENT, text=text)
    elif settings.com_arm_wo_gps == 1:
        findings.arming_check_failure(NO_MODE, Component.GPS, Severity.WARNING, EVENT, text=TOLD)
