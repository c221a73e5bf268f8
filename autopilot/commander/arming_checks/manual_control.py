"""No switch is on that is none for arming (PX4's manualControlCheck).

Switches of a receiver that has fallen silent count as they were last.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

SWITCH_POS_ON: Final = 1
TOLD = (
    ("return_to_launch", "check_man_control_rtl_engaged", "Preflight Fail: RTL switch engaged"),
    ("kill", "check_man_control_kill_engaged", "Preflight Fail: Kill switch engaged"),
    ("gear", "check_man_control_landing_gear_up", "Preflight Fail: Landing gear switch set in UP position"),
)
"""Switch, event and text."""


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Of a vehicle that is not armed."""
    if topics.vehicle_status.armed:
        return
    for switch, event, text in TOLD:
        if getattr(topics.manual_control_switches, switch) == SWITCH_POS_ON:
            findings.arming_check_failure(ALL_MODES, Component.REMOTE_CONTROL, Severity.ERROR, event, text=text)
