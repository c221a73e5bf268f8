"""The navigator can fly what it is to fly (PX4's navigatorCheck)."""

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """What the navigator says of another mode than the present one changes nothing."""
    status = topics.navigator_status
    findings.navigator_failure = topics.failsafe_flags.navigator_failure
    if status.nav_state != topics.vehicle_status.nav_state:
        return
    findings.navigator_failure = status.failure != 0
    if findings.navigator_failure:
        event = "check_navigator_failure_hagl"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.ERROR, event)
