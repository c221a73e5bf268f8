"""The mission did not fail (PX4's missionCheck). Whether there is one at all: mode.py."""

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Says whether MISSION can be flown and whether it failed."""
    result = topics.mission_result
    findings.auto_mission_missing = not result.valid
    findings.mission_failure = result.valid and result.failure
    if findings.mission_failure:
        event, text = "check_mission_failure", "Mission cannot be completed\t"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, event, text=text)
