"""A flight that was terminated forbids arming until the next start, and so do killed motors (PX4's systemCheck)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

EVENT: Final = "check_system_flight_term_active"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Termination cannot be undone; a kill, by whatever it came, has the same event and text."""
    if topics.vehicle_status.termination or topics.actuator_armed.kill:
        text = "Preflight Fail: Flight termination active"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.CRITICAL, EVENT, text=text)
