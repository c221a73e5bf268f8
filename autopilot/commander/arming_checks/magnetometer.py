"""Magnetometer: samples keep coming, and it is calibrated and in use (PX4's magnetometerCheck)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

TIMEOUT_US: Final = 1_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """One that the estimator uses has to send, to have a calibration of its own (CAL_MAGn_ID) and to be no fault; on
    the ground as many as SYS_HAS_MAG says have to be calibrated and enabled (CAL_MAGn_PRIO). 0: nothing is asked.
    """
    required = settings.sys_has_mag
    if not required:
        return
    timestamp = topics.sensor_mag.timestamp
    component = Component.MAGNETOMETER
    if timestamp:
        findings.health_present |= component
        if now_us - timestamp > TIMEOUT_US:
            text = "Preflight Fail: No valid data from Compass 0"
            findings.health_failure(ALL_MODES, component, Severity.ERROR, "check_mag_no_data", 0, text=text)
            return
        if "MAG" not in settings.calibrated:
            text = "Preflight Fail: Compass 0 uncalibrated"
            uncalibrated = (ALL_MODES, component, Severity.ERROR, "check_mag_not_calibrated", 0)
            findings.arming_check_failure(*uncalibrated, text=text)
            return
        if topics.estimator_status_flags.cs_mag_fault:
            text = "Preflight Fail: Compass 0 fault"
            findings.arming_check_failure(ALL_MODES, component, Severity.ERROR, "check_mag_fault", 0, text=text)
            return
    found = int(timestamp > 0 and settings.mag_enabled)
    if found < required and not topics.vehicle_status.armed:
        text = f"Preflight Fail: Found {found} compass (required: {required})"
        missing = (ALL_MODES, component, Severity.ERROR, "check_mag_sys_has_mag_missing", found, required)
        findings.arming_check_failure(*missing, text=text)
