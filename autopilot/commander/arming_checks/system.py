"""A flight that was terminated forbids arming until the next start (part of PX4's systemCheck)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

EVENT: Final = "check_system_flight_term_active"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Termination cannot be undone."""
    if topics.vehicle_status.termination:
        text = "Preflight Fail: Flight termination active"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.CRITICAL, EVENT, text=text)
