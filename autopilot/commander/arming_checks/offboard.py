"""Offboard setpoints keep coming within COM_OF_LOSS_T, and what they ask for can be held (PX4's offboardCheck)."""

from sitl_emu.autopilot.commander.arming_checks.findings import Component, Findings, Settings
from sitl_emu.autopilot.commander.control_mode import asks_for_position, has_any
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.topics import OffboardSetpoint, Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Runs after the estimator's check. What the last setpoint lacks is told, however old it is, and else its age."""
    setpoint = topics.offboard_setpoint
    event = _lack(setpoint, findings) if setpoint.timestamp else ""
    if not event and (setpoint.timestamp == 0 or now_us - setpoint.timestamp > settings.com_of_loss_us):
        event = "check_modes_offboard_signal_lost"
    findings.offboard_control_signal_lost = bool(event)
    if event:
        findings.arming_check_failure(1 << NavState.OFFBOARD, Component.SYSTEM, Severity.ERROR, event)


def _lack(setpoint: OffboardSetpoint, findings: Findings) -> str:
    """The event for what it needs and is not there: any axis of a position needs one, and so on."""
    trajectory = setpoint.trajectory
    if asks_for_position(setpoint) and findings.local_position_invalid:
        return "check_modes_offboard_no_local_position"
    if trajectory is not None and has_any(trajectory.velocity) and findings.local_velocity_invalid:
        return "check_modes_offboard_no_local_velocity"
    by_attitude = setpoint.attitude is not None or (trajectory is not None and has_any(trajectory.acceleration))
    return "check_modes_offboard_no_attitude" if by_attitude and findings.attitude_invalid else ""
