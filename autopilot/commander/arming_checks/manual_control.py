"""Sticks have been seen within COM_RC_LOSS_T (PX4's rcAndDataLinkCheck); no switch is on that is none for arming.

Switches of a receiver that has fallen silent count as they were last (PX4's manualControlCheck).
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Notice, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

SWITCH_POS_ON: Final = 1
LOST, REGAINED = "commander_rc_lost", "commander_rc_regained"
TOLD = (
    ("return_to_launch", "check_man_control_rtl_engaged", "Preflight Fail: RTL switch engaged"),
    ("kill", "check_man_control_kill_engaged", "Preflight Fail: Kill switch engaged"),
)
"""Switch, event and text."""


class ManualControlCheck:
    """Lost sticks end the modes that are flown by them; remembers when they were there, to tell who comes back."""

    def __init__(self) -> None:
        self._lost = True
        self._seen_us = 0
        """When sticks were valid last, 0: never."""

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """See the module."""
        sticks = topics.manual_control_setpoint
        lost = not sticks.valid or sticks.timestamp == 0 or now_us - sticks.timestamp > settings.com_rc_loss_us
        findings.manual_control_signal_lost = lost
        if lost is not self._lost and self._seen_us:
            away_s = (now_us - self._seen_us) * 1e-6
            told = Notice(LOST, Severity.INFO) if lost else Notice(REGAINED, Severity.INFO, (away_s,))
            findings.notices.append(told)
        self._lost = lost
        if not lost:
            self._seen_us = sticks.timestamp
            findings.health_present |= Component.REMOTE_CONTROL
        if topics.vehicle_status.armed:
            return
        for switch, event, text in TOLD:
            if getattr(topics.manual_control_switches, switch) == SWITCH_POS_ON:
                findings.arming_check_failure(ALL_MODES, Component.REMOTE_CONTROL, Severity.ERROR, event, text=text)
