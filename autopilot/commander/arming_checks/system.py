"""A flight that was terminated forbids arming until the next start (part of PX4's systemCheck)."""

from autopilot.commander.arming_checks.findings import Findings, Settings
from autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Termination cannot be undone."""
    if topics.vehicle_status.termination:
        findings.forbid_arming(0, "Preflight Fail: Flight termination active")
