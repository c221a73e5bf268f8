"""Inside the fence or not (PX4's geofenceCheck). Outside, arming is forbidden unless GF_ACTION is none."""

from autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from autopilot.constants import Severity
from autopilot.topics import Topics

BREACH_MAXALT = 2
EVENTS = {BREACH_MAXALT: "check_gf_violation_max_alt"}
EVENT_OTHER = "check_gf_violation_custom_gf"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A breach with an action."""
    result = topics.geofence_result
    findings.geofence_breached = result.breached and result.action != 0
    if findings.geofence_breached:
        event = EVENTS.get(result.breach_type, EVENT_OTHER)
        text = "" if topics.vehicle_status.armed else "Preflight Fail: Vehicle outside geofence"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, event, text=text)
