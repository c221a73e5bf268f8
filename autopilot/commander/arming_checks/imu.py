"""Accelerometer and gyro: samples keep coming (PX4's accelerometerCheck and gyroCheck)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.system import failure_injection
from sitl_emu.autopilot.topics import Topics

TIMEOUT_US: Final = 1_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """No sample of both for a second: one of them is silent, or both; the vehicle knows its rates no more.

    Both need a calibration of their own (CAL_ACCn_ID, CAL_GYROn_ID).
    """
    timestamp = topics.sensor_combined.timestamp
    if timestamp:
        findings.health_present |= Component.ACCEL | Component.GYRO
    if now_us - timestamp <= TIMEOUT_US:
        if "ACC" not in settings.calibrated:
            accel = (ALL_MODES, Component.ACCEL, Severity.ERROR, "check_accel_not_calibrated", 0)
            findings.arming_check_failure(*accel, text="Preflight Fail: Accel 0 uncalibrated")
        if "GYRO" not in settings.calibrated:
            gyro = (ALL_MODES, Component.GYRO, Severity.ERROR, "check_gyro_not_calibrated", 0)
            findings.arming_check_failure(*gyro, text="Preflight Fail: Gyro 0 uncalibrated")
        return
    findings.angular_velocity_invalid = True
    failures = topics.failure_injection
    accel_off = failures.type_of(failure_injection.ACCEL, 1) == failure_injection.OFF
    gyro_off = failures.type_of(failure_injection.GYRO, 1) == failure_injection.OFF
    lacks = "no_data" if timestamp else "missing"
    if accel_off or not gyro_off:
        accel = (ALL_MODES, Component.ACCEL, Severity.ERROR, f"check_accel_{lacks}", 0)
        findings.health_failure(*accel, text="Preflight Fail: No valid data from Accel 0")
    if gyro_off or not accel_off:
        gyro = (ALL_MODES, Component.GYRO, Severity.ERROR, f"check_gyro_{lacks}", 0)
        findings.health_failure(*gyro, text="Preflight Fail: No valid data from Gyro 0")
