"""A companion computer that says how hot it is: COM_CC_TEMP_WARN (PX4's companionComputerCheck). It forbids nothing."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

EVENT: Final = "check_companion_computer_temperature_high"
FRESH_US: Final = 5_000_000
UNKNOWN: Final = 127


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A limit of 0 or less: nobody looks. PX4 has no text for it."""
    status = topics.onboard_computer_status
    fresh = status.timestamp > 0 and now_us - status.timestamp <= FRESH_US
    if settings.com_cc_temp_warn <= 0.0 or not fresh or status.temperature_board == UNKNOWN:
        return
    if status.temperature_board >= settings.com_cc_temp_warn:
        warm = status.temperature_board
        findings.health_failure(NO_MODE, Component.SYSTEM, Severity.WARNING, EVENT, warm)
