"""Home is set (PX4's homePositionCheck)."""

from sitl_emu.autopilot.commander.arming_checks.findings import Findings, Settings
from sitl_emu.autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Returning needs a home."""
    findings.home_position_invalid = not topics.home_position.valid
