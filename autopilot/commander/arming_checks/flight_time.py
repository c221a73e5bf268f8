"""Flown longer than COM_FLT_TIME_MAX (PX4's flightTimeCheck; less than a second: no limit)."""

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Counts from takeoff."""
    takeoff_us = topics.vehicle_status.takeoff_time
    if settings.com_flt_time_max_us > 0 and takeoff_us > 0 and now_us - takeoff_us > settings.com_flt_time_max_us:
        findings.flight_time_limit_exceeded = True
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, "check_flight_time_limit")
