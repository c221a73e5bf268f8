"""Which controllers a mode asks for: PX4's vehicle_control_mode (commander/ModeUtil/control_mode.cpp, v1.18)."""

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import (
    ATTITUDE,
    FLIGHT_MODES,
    NOTHING,
    RATES,
    THRUST_AND_TORQUE,
    TRAJECTORY,
    ControlMode,
)
from sitl_emu.autopilot.topics import OffboardSetpoint, TrajectorySetpoint, Vector3, VehicleStatus
from sitl_emu.autopilot.vehicle_kind import Traits


def control_mode(nav_state: NavState, traits: Traits, offboard: OffboardSetpoint) -> ControlMode:
    """What the mode asks for on a kind of vehicle; in OFFBOARD this follows from what the last setpoint carries."""
    if nav_state is NavState.OFFBOARD:
        return asked_for(offboard)._replace(offboard=True)
    if nav_state is NavState.MANUAL and not traits.manual_controls_attitude:
        return THRUST_AND_TORQUE._replace(manual=True)
    return FLIGHT_MODES[nav_state].control


def asked_for(offboard: OffboardSetpoint) -> ControlMode:
    """What an offboard setpoint asks for."""
    if offboard.trajectory is not None:
        return _of_trajectory(offboard.trajectory)
    if offboard.attitude is not None:
        return ATTITUDE
    if offboard.rates is not None:
        return RATES
    return THRUST_AND_TORQUE if offboard.thrust_and_torque is not None else NOTHING


def _of_trajectory(trajectory: TrajectorySetpoint) -> ControlMode:
    """By any axis of its position, else of its velocity; acceleration alone asks for no climb rate."""
    if has_any(trajectory.position):
        return TRAJECTORY
    if has_any(trajectory.velocity) or not has_any(trajectory.acceleration):
        return TRAJECTORY._replace(position=False)
    return TRAJECTORY._replace(position=False, altitude=False, climb_rate=False)


def asks_for_position(offboard: OffboardSetpoint) -> bool:
    """offboard_control_mode.position: any axis of it."""
    return offboard.trajectory is not None and has_any(offboard.trajectory.position)


def is_of_mode(time_us: int, status: VehicleStatus) -> bool:
    """Whether a setpoint of this time has come at all (0: never), and since the present mode was entered."""
    return time_us > 0 and time_us >= status.nav_state_timestamp


def has_any(vector: Vector3) -> bool:
    """Whether an axis of it is controlled."""
    x, y, z = vector
    return x == x or y == y or z == z
