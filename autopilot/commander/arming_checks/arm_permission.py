"""COM_ARMABLE 0 forbids arming altogether (PX4's armPermissionCheck)."""

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A vehicle that is in the workshop."""
    if settings.com_armable < 1:
        event, text = "check_armable_configuration", "Preflight Fail: Vehicle is in safety configuration"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, event, text=text)
