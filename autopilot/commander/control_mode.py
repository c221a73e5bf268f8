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
from sitl_emu.autopilot.topics import OffboardSetpoint
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
    if offboard.attitude is not None:
        return ATTITUDE
    if offboard.rates is not None:
        return RATES
    if offboard.trajectory is None:
        return NOTHING
    return TRAJECTORY if asks_for_position(offboard) else TRAJECTORY._replace(position=False)


def asks_for_position(offboard: OffboardSetpoint) -> bool:
    """offboard_control_mode.position: any axis of it."""
    trajectory = offboard.trajectory
    return trajectory is not None and any(axis == axis for axis in trajectory.position)
