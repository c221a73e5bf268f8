"""Offboard setpoints keep coming within COM_OF_LOSS_T, and what they ask for can be held (PX4's offboardCheck)."""

from sitl_emu.autopilot.commander.arming_checks.findings import Component, Findings, Settings
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Runs after the estimator's check: a position setpoint needs a position, a velocity setpoint a velocity."""
    setpoint = topics.offboard_setpoint
    trajectory = setpoint.trajectory
    event = ""
    if setpoint.timestamp == 0 or now_us - setpoint.timestamp > settings.com_of_loss_us:
        event = "check_modes_offboard_signal_lost"
    elif trajectory is not None:
        if trajectory.position[0] == trajectory.position[0]:
            if findings.local_position_invalid:
                event = "check_modes_offboard_no_local_position"
        elif trajectory.velocity[0] == trajectory.velocity[0] and findings.local_velocity_invalid:
            event = "check_modes_offboard_no_local_velocity"
    findings.offboard_control_signal_lost = bool(event)
    if event:
        findings.arming_check_failure(1 << NavState.OFFBOARD, Component.SYSTEM, Severity.ERROR, event)
