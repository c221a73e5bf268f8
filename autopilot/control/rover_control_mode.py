"""Which of a rover's controllers a mode asks for (PX4's ModeUtil/control_mode.cpp and setpoint_types.cpp, v1.18).

vehicle_control_mode, as far as a rover's control looks at it. A mode of aircraft asks for controllers as well, and as
it gives them nothing new to do, they go on with what they had.
"""

from typing import NamedTuple

from autopilot.constants import NavState
from autopilot.topics import OffboardSetpoint


class ControlMode(NamedTuple):
    """The flags flag_control_*_enabled."""

    position: bool = False
    velocity: bool = False
    attitude: bool = False
    rates: bool = False
    allocation: bool = False


ALL = ControlMode(position=True, velocity=True, attitude=True, rates=True, allocation=True)
FROM_VELOCITY = ALL._replace(position=False)
FROM_ATTITUDE = FROM_VELOCITY._replace(velocity=False)
FROM_RATES = FROM_ATTITUDE._replace(attitude=False)
DIRECT = ControlMode(allocation=True)
NOTHING = ControlMode()
OF_STICKS = {
    NavState.MANUAL: DIRECT,
    NavState.ACRO: FROM_RATES,
    NavState.STAB: FROM_ATTITUDE,
    NavState.ALTCTL: FROM_ATTITUDE,
    NavState.ALTITUDE_CRUISE: FROM_ATTITUDE,
    NavState.DESCEND: FROM_ATTITUDE,
    NavState.TERMINATION: NOTHING,
}


def control_mode(nav_state: NavState, offboard: OffboardSetpoint) -> ControlMode:
    """What the mode asks for; in OFFBOARD this follows from what the last setpoint carries."""
    if nav_state is not NavState.OFFBOARD:
        return OF_STICKS.get(nav_state, ALL)
    if offboard.attitude is not None:
        return FROM_ATTITUDE
    if offboard.rates is not None:
        return FROM_RATES
    if offboard.trajectory is None:
        return NOTHING
    return ALL if asks_for_position(offboard) else FROM_VELOCITY


def asks_for_position(offboard: OffboardSetpoint) -> bool:
    """offboard_control_mode.position: any axis of it."""
    trajectory = offboard.trajectory
    return trajectory is not None and any(axis == axis for axis in trajectory.position)
