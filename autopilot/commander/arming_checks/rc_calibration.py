"""The ends and the centre of each channel of a receiver, RCn_MIN, RCn_TRIM and RCn_MAX, are in order (PX4's
rcCalibrationCheck). Where COM_RC_IN_MODE wants no receiver nobody looks, nor in flight.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

WITHOUT_RECEIVER = (1, 4)
"""COM_RC_IN_MODE: MAVLink alone, and no sticks at all."""
LOWEST_US: Final = 0
HIGHEST_US: Final = 2500


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """All that is wrong with each channel."""
    if topics.vehicle_status.armed or settings.com_rc_in_mode in WITHOUT_RECEIVER:
        return
    for number, (least, centre, most) in enumerate(settings.rc_channels, 1):
        if least < LOWEST_US:
            _fail(findings, "min_too_small", f"RC{number}_MIN < {LOWEST_US}", number, LOWEST_US)
        if most > HIGHEST_US:
            _fail(findings, "max_too_high", f"RC{number}_MAX > {HIGHEST_US}", number, HIGHEST_US)
        if centre < least:
            beside = int(centre), int(least)
            _fail(findings, "trim_too_small", f"RC{number}_TRIM < MIN ({beside[0]}/{beside[1]})", number, *beside)
        if centre > most:
            beside = int(centre), int(most)
            _fail(findings, "trim_too_high", f"RC{number}_TRIM > MAX ({beside[0]}/{beside[1]})", number, *beside)


def _fail(findings: Findings, event: str, what: str, *told: int) -> None:
    failure = ALL_MODES, Component.REMOTE_CONTROL, Severity.ERROR, f"check_rc_{event}"
    findings.arming_check_failure(*failure, *told, text=f"Preflight Fail: RC ERROR: {what}")
