"""A rally point where RTL_TYPE 5 wants one (PX4's rallyPointCheck): without it a return lands where the vehicle is."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

RALLY_POINTS_ALONE: Final = 5
"""RTL_TYPE."""
NO_RALLY_POINT: Final = 255
"""rtl_status.safe_point_index."""


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A warning; nothing is said before the navigator has looked."""
    status = topics.rtl_status
    if settings.rtl_type == RALLY_POINTS_ALONE and status.timestamp and status.safe_point_index == NO_RALLY_POINT:
        event, text = "check_rally_point_missing", "No rally point configured\t"
        level = Severity.WARNING
        findings.arming_check_failure(NO_MODE, Component.SYSTEM, level, event, text=text, said_as=level)
