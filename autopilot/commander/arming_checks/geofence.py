"""Inside the fence or not (PX4's geofenceCheck). Outside, arming is forbidden unless GF_ACTION is none."""

from autopilot.commander.arming_checks.findings import Findings, Settings
from autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A breach with an action."""
    result = topics.geofence_result
    findings.geofence_breached = result.breached and result.action != 0
    if findings.geofence_breached and not topics.vehicle_status.armed:
        findings.forbid_arming(0, "Preflight Fail: Vehicle outside geofence")
