"""Sticks have been seen within COM_RC_LOSS_T, a ground station within COM_DL_LOSS_T (PX4's rcAndDataLinkCheck)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import (
    ALL_MODES,
    NO_MODE,
    Component,
    Findings,
    Notice,
    Settings,
)
from sitl_emu.autopilot.commander.data_links import gcs_is_lost
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

NO_DATA_LINK: Final = "check_rc_dl_no_dllink"
STICKS_LOST, STICKS_REGAINED = "commander_rc_lost", "commander_rc_regained"


class RcAndDataLinkCheck:
    """Remembers when sticks were there, to tell of those that come back.

    It comes after the check of the modes, to which sticks are lost, or there, one run later.
    """

    def __init__(self) -> None:
        self._lost = True
        self._seen_us = 0
        """When sticks were valid last, 0: never."""

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """Lost sticks end the modes that are flown by them."""
        sticks = topics.manual_control_setpoint
        lost = not sticks.valid or sticks.timestamp == 0 or now_us - sticks.timestamp > settings.com_rc_loss_us
        findings.manual_control_signal_lost = lost
        if lost is not self._lost and self._seen_us:
            away_s = (now_us - self._seen_us) * 1e-6
            told = Notice(STICKS_LOST, Severity.INFO) if lost else Notice(STICKS_REGAINED, Severity.INFO, (away_s,))
            findings.notices.append(told)
        self._lost = lost
        if not lost:
            self._seen_us = sticks.timestamp
            findings.health_present |= Component.REMOTE_CONTROL
        check_data_link(now_us, topics, settings, findings)


def check_data_link(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A ground station that was never there counts as lost, too. With NAV_DLL_ACT it is needed for arming."""
    lost = gcs_is_lost(now_us, topics.gcs_heartbeats.gcs_us, settings.com_dl_loss_us)
    findings.gcs_connection_lost = lost
    if not lost:
        findings.health_present |= Component.COMMUNICATION_LINKS
    elif settings.nav_dll_act > 0:
        text, said_as = "Preflight Fail: No connection to the GCS", Severity.WARNING
        failure = (ALL_MODES, Component.COMMUNICATION_LINKS, Severity.ERROR, NO_DATA_LINK)
        findings.arming_check_failure(*failure, text=text, said_as=said_as)
    else:
        findings.arming_check_failure(NO_MODE, Component.COMMUNICATION_LINKS, Severity.INFO, NO_DATA_LINK)
