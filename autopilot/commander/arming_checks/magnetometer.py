"""Magnetometer: samples keep coming (PX4's magnetometerCheck)."""

from autopilot.commander.arming_checks.findings import MAG, Findings, Settings
from autopilot.topics import Topics

TIMEOUT_US = 1_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """No sample for a second forbids arming."""
    if now_us - topics.sensor_mag.timestamp > TIMEOUT_US:
        findings.forbid_arming(MAG, "Preflight Fail: No valid data from Compass 0")
