"""Wind that is too strong (PX4's windCheck): told of from COM_WIND_WARN on, and from COM_WIND_MAX on where
COM_WIND_MAX_ACT only warns; any other action of that makes it a failsafe, and forbids arming.
"""

import math
from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Notice, Settings
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.topics import Topics

ONLY_WARN: Final = 1
"""COM_WIND_MAX_ACT; less does nothing, more is done by failsafe.py."""
WARNED_APART_US: Final = 60_000_000
LANDS = (NavState.AUTO_RTL, NavState.AUTO_LAND)
"""Who comes home or down already is not advised to."""


class WindCheck:
    """Warns at once, and then every minute."""

    def __init__(self) -> None:
        self._warned_us = 0

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """What the filter estimates, or was told; a limit of 0 or less is none."""
        warned_from, limit, action = settings.com_wind_warn, settings.com_wind_max, settings.com_wind_max_act
        if not topics.wind.timestamp:
            return
        wind_m_s = math.hypot(topics.wind.windspeed_north, topics.wind.windspeed_east)
        too_strong = 0.0 < limit < wind_m_s
        if too_strong and action > ONLY_WARN:
            findings.wind_limit_exceeded = True
            failure = ALL_MODES, Component.SYSTEM, Severity.WARNING, "check_wind_too_high"
            findings.arming_check_failure(*failure, wind_m_s)
            return
        told_lately = self._warned_us > 0 and now_us - self._warned_us <= WARNED_APART_US
        if told_lately or topics.vehicle_status.nav_state in LANDS:
            return
        event = "check_high_wind_warning" if 0.0 < warned_from < wind_m_s else ""
        if too_strong and action == ONLY_WARN:
            event = "check_above_wind_limits_warning"
        if event:
            self._warned_us = now_us
            findings.notices.append(Notice(event, Severity.WARNING, (wind_m_s,)))
