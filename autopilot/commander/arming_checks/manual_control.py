"""Sticks have been seen within COM_RC_LOSS_T, and nobody has killed the motors (PX4's manualControlCheck)."""

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, RC_RECEIVER, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Lost sticks end the modes that are flown by them."""
    sticks = topics.manual_control_setpoint
    lost = not sticks.valid or sticks.timestamp == 0 or now_us - sticks.timestamp > settings.com_rc_loss_us
    findings.manual_control_signal_lost = lost
    if lost:
        findings.unhealthy |= RC_RECEIVER
    else:
        findings.health_present |= Component.REMOTE_CONTROL
    if topics.actuator_armed.kill:
        component = Component.REMOTE_CONTROL
        findings.arming_check_failure(ALL_MODES, component, Severity.ERROR, "check_man_control_kill_engaged")
