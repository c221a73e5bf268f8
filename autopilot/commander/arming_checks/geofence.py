"""Inside the fence or not (PX4's geofenceCheck). Outside, arming is forbidden unless GF_ACTION is none."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

TOLD = (
    ("max_dist_triggered", "check_gf_violation_max_hor_dist", "Geofence: exceeding maximum distance to Home"),
    ("max_alt_triggered", "check_gf_violation_max_alt", "Geofence: exceeding maximum altitude above Home"),
    ("custom_fence_triggered", "check_gf_violation_custom_gf", "Geofence: approaching or outside geofence"),
)
"""What is broken, by geofence_result's field, with its event and text, which has no tab though it has an event."""
ACTION_RETURN: Final = 3
TEXT_NO_HOME: Final = "Preflight Fail: Geofence RTL requires valid home"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A breach with an action, or an action that is not possible."""
    result = topics.geofence_result
    findings.geofence_breached = result.breached and result.action != 0
    if findings.geofence_breached:
        for field, event, text in TOLD:
            if getattr(result, field):
                findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, event, text=text)
    if result.action == ACTION_RETURN and not topics.home_position.valid:
        no_home = "check_gf_no_home"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, no_home, text=TEXT_NO_HOME)
