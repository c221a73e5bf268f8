"""Accelerometer and gyro: samples keep coming (PX4's accelerometerCheck and gyroCheck)."""

from autopilot.commander.arming_checks.findings import ACCEL, GYRO, Findings, Settings
from autopilot.topics import Topics

TIMEOUT_US = 1_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """No sample for a second: neither may arm nor knows its rates."""
    if now_us - topics.sensor_combined.timestamp > TIMEOUT_US:
        findings.angular_velocity_invalid = True
        findings.forbid_arming(ACCEL | GYRO, "Preflight Fail: No valid data from Accel 0")
