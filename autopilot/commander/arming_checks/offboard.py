"""Offboard setpoints keep coming within COM_OF_LOSS_T, and what they ask for can be held (PX4's offboardCheck)."""

from autopilot.commander.arming_checks.findings import Findings, Settings
from autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Runs after the estimator's check: a position setpoint needs a position, a velocity setpoint a velocity."""
    setpoint = topics.offboard_setpoint
    lost = setpoint.timestamp == 0 or now_us - setpoint.timestamp > settings.com_of_loss_us
    trajectory = setpoint.trajectory
    if not lost and trajectory is not None:
        if trajectory.position[0] == trajectory.position[0]:
            lost = findings.local_position_invalid
        elif trajectory.velocity[0] == trajectory.velocity[0]:
            lost = findings.local_velocity_invalid
    findings.offboard_control_signal_lost = lost
