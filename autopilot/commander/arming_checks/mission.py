"""There is a mission that can be flown (PX4's missionCheck). COM_ARM_MIS_REQ 1 forbids arming without one."""

from autopilot.commander.arming_checks.findings import Findings, Settings
from autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Says whether MISSION can be flown and whether it failed."""
    result = topics.mission_result
    findings.auto_mission_missing = not result.valid
    findings.mission_failure = result.failure
    if settings.com_arm_mis_req and not result.valid:
        findings.forbid_arming(0, "Preflight Fail: No valid mission available")
