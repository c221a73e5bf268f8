"""Barometer: samples keep coming (PX4's baroCheck)."""

from autopilot.commander.arming_checks.findings import ABSOLUTE_PRESSURE, Findings, Settings
from autopilot.topics import Topics

TIMEOUT_US = 1_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """No sample for a second forbids arming."""
    if now_us - topics.sensor_baro.timestamp > TIMEOUT_US:
        findings.forbid_arming(ABSOLUTE_PRESSURE, "Preflight Fail: barometer 0 missing")
