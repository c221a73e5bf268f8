"""As many power modules as are wanted (PX4's powerCheck); CBRK_SUPPLY_CHK breaks it.

PX4's simulation has one brick at 5 V (SystemPowerSimulator.cpp).
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.battery import SUPPLY_CHECK_BROKEN
from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

BRICKS: Final = 1
EVENT: Final = "check_avionics_power_redundancy"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """COM_POWER_COUNT."""
    wanted = settings.com_power_count
    if settings.cbrk_supply_chk == SUPPLY_CHECK_BROKEN or wanted <= BRICKS:
        return
    failure = (ALL_MODES, Component.SYSTEM, Severity.ERROR, EVENT, BRICKS, wanted)
    findings.arming_check_failure(*failure, text=f"Preflight Fail: Power redundancy not met: {BRICKS} of {wanted}")
