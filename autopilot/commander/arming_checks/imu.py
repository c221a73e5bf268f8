"""Accelerometer and gyro: samples keep coming (PX4's accelerometerCheck and gyroCheck)."""

from autopilot import failure_injection
from autopilot.commander.arming_checks.findings import ACCEL, GYRO, Findings, Settings
from autopilot.topics import Topics

TIMEOUT_US = 1_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """No sample of both for a second: one of them is silent, or both; the vehicle knows its rates no more."""
    if now_us - topics.sensor_combined.timestamp <= TIMEOUT_US:
        return
    findings.angular_velocity_invalid = True
    failures = topics.failure_injection
    accel_off = failures.type_of(failure_injection.ACCEL, 1) == failure_injection.OFF
    gyro_off = failures.type_of(failure_injection.GYRO, 1) == failure_injection.OFF
    if accel_off or not gyro_off:
        findings.forbid_arming(ACCEL, "Preflight Fail: No valid data from Accel 0")
    if gyro_off or not accel_off:
        findings.forbid_arming(GYRO, "Preflight Fail: No valid data from Gyro 0")
