"""A flight that was terminated forbids arming until the next start, and so do killed motors (PX4's systemCheck).

COM_ARM_WO_GPS 0 wants a global position and a home before arming. Somebody else's leave, which arming may need
(COM_ARM_AUTH_REQ), is asked for by `arming.py`.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

EVENT: Final = "check_system_flight_term_active"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Runs after the checks of position and home. A kill, by whatever it came, has a termination's event and text."""
    if topics.vehicle_status.termination or topics.actuator_armed.kill:
        text = "Preflight Fail: Flight termination active"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.CRITICAL, EVENT, text=text)
    if not (settings.com_arm_wo_gps or topics.vehicle_status.armed):
        _check_place(findings)
    if findings.arm_authorization_denied:
        event = "check_system_arm_auth_failed"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, event)


def _check_place(findings: Findings) -> None:
    if findings.global_position_invalid:
        event, text = "check_system_no_global_pos", "Preflight Fail: Global position estimate required"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, event, text=text)
    elif findings.home_position_invalid:
        event, text = "check_system_no_home_pos", "Preflight Fail: Home position required"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, event, text=text)
