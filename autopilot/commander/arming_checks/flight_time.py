"""Flown longer than COM_FLT_TIME_MAX, or soon (PX4's flightTimeCheck; less than a second: no limit)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Notice, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

WARNED_SHARE: Final = 0.1
"""Of the longest flight: in what is left then, people are warned."""
MINUTE_S: Final = 60
BY_SECONDS: Final = "commander_max_flight_time_warning_seconds"
BY_MINUTES: Final = "commander_max_flight_time_warning_minutes"


class FlightTimeCheck:
    """Counts from takeoff; warns each full minute, and once where less is left when warning begins."""

    def __init__(self) -> None:
        self._looked_at_s: int | None = None

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """Whether the flight may go on."""
        takeoff_us, longest_us = topics.vehicle_status.takeoff_time, settings.com_flt_time_max_us
        before_s, self._looked_at_s = self._looked_at_s, None
        if longest_us <= 0 or takeoff_us <= 0:
            return
        left_us = longest_us - (now_us - takeoff_us)
        if left_us < 0:
            findings.flight_time_limit_exceeded = True
            failure = ALL_MODES, Component.SYSTEM, Severity.ERROR, "check_flight_time_limit"
            findings.arming_check_failure(*failure, text="Maximum flight time reached\t")
        elif left_us < WARNED_SHARE * longest_us:
            left_s = self._looked_at_s = left_us // 1_000_000
            if left_s <= MINUTE_S and before_s is None:
                findings.notices.append(Notice(BY_SECONDS, Severity.WARNING, (left_s,)))
            elif left_s % MINUTE_S == 0 and left_s >= MINUTE_S and left_s != before_s:
                findings.notices.append(Notice(BY_MINUTES, Severity.WARNING, (left_s // MINUTE_S,)))
