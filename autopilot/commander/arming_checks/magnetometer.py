"""Magnetometer: samples keep coming (PX4's magnetometerCheck)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

TIMEOUT_US: Final = 1_000_000
NO_DATA = ("check_mag_no_data", "Preflight Fail: No valid data from Compass 0")
MISSING = ("check_mag_missing", "Preflight Fail: Compass Sensor 0 missing")


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """No sample for a second, or no calibration of its own (CAL_MAGn_ID), forbids arming, unless there is none at all
    (SYS_HAS_MAG).
    """
    if not settings.sys_has_mag:
        return
    timestamp = topics.sensor_mag.timestamp
    if timestamp:
        findings.health_present |= Component.MAGNETOMETER
    if now_us - timestamp > TIMEOUT_US:
        event, text = NO_DATA if timestamp else MISSING
        findings.health_failure(ALL_MODES, Component.MAGNETOMETER, Severity.ERROR, event, 0, text=text)
    elif "MAG" not in settings.calibrated:
        mag = (ALL_MODES, Component.MAGNETOMETER, Severity.ERROR, "check_mag_not_calibrated", 0)
        findings.arming_check_failure(*mag, text="Preflight Fail: Compass 0 uncalibrated")
