"""A log is being written (PX4's loggerCheck): shown as present, and nothing depends on it."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import Component, Findings, Settings
from sitl_emu.autopilot.topics import Topics

TIMEOUT_US: Final = 3_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """PX4's logger says so once a second while it writes."""
    status = topics.logger_status
    if status.is_logging and now_us - status.timestamp < TIMEOUT_US:
        findings.health_present |= Component.LOGGING
