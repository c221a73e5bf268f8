"""Barometer: samples keep coming (PX4's baroCheck)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

TIMEOUT_US: Final = 1_000_000


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """No sample for a second forbids arming, unless there is no barometer at all (SYS_HAS_BARO)."""
    if not settings.sys_has_baro:
        return
    timestamp = topics.sensor_baro.timestamp
    if timestamp:
        findings.health_present |= Component.ABSOLUTE_PRESSURE
    if now_us - timestamp <= TIMEOUT_US:
        return
    event, text = "check_baro_no_data", "Preflight Fail: No valid data from Baro 0"
    if not timestamp:
        event, text = "check_baro_missing", "Preflight Fail: barometer 0 missing"
    findings.health_failure(ALL_MODES, Component.ABSOLUTE_PRESSURE, Severity.ERROR, event, 0, text=text)
