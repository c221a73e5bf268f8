"""What each mode needs to be flown, and which modes forbid arming.

PX4's src/modules/commander/ModeUtil/mode_requirements.cpp (v1.18) as one table. External modes have nobody to fly them
here, so they can be chosen on the ground but never run.
"""

from enum import IntFlag, auto

from autopilot.constants import NavState
from autopilot.topics import FailsafeFlags


class Need(IntFlag):
    """Conditions, each answered by a flag of FailsafeFlags."""

    ANGULAR_VELOCITY = auto()
    ATTITUDE = auto()
    LOCAL_ALT = auto()
    LOCAL_POSITION = auto()
    GLOBAL_POSITION = auto()
    HOME_POSITION = auto()
    MISSION = auto()
    OFFBOARD_SIGNAL = auto()
    MANUAL_CONTROL = auto()
    WIND_AND_FLIGHT_TIME = auto()
    OTHER = auto()
    """Never met: nobody runs the mode."""


_ATTITUDE = Need.ANGULAR_VELOCITY | Need.ATTITUDE
_ALTITUDE = _ATTITUDE | Need.LOCAL_ALT
_POSITION = _ALTITUDE | Need.LOCAL_POSITION
_GLOBAL = _POSITION | Need.GLOBAL_POSITION

NEEDS: dict[NavState, Need] = {
    **dict.fromkeys((NavState(number) for number in range(NavState.EXTERNAL1, NavState.EXTERNAL8 + 1)), Need.OTHER),
    NavState.MANUAL: Need.MANUAL_CONTROL,
    NavState.ALTCTL: _ALTITUDE | Need.MANUAL_CONTROL,
    NavState.ALTITUDE_CRUISE: _ALTITUDE | Need.MANUAL_CONTROL,
    NavState.POSCTL: _POSITION | Need.MANUAL_CONTROL,
    NavState.POSITION_SLOW: _POSITION | Need.MANUAL_CONTROL,
    NavState.AUTO_MISSION: _GLOBAL | Need.MISSION | Need.WIND_AND_FLIGHT_TIME,
    NavState.AUTO_LOITER: _GLOBAL | Need.WIND_AND_FLIGHT_TIME,
    NavState.AUTO_RTL: _GLOBAL | Need.HOME_POSITION,
    NavState.GUIDED_COURSE: _GLOBAL,
    NavState.ACRO: Need.ANGULAR_VELOCITY | Need.MANUAL_CONTROL,
    NavState.DESCEND: _ATTITUDE,
    NavState.TERMINATION: Need(0),
    NavState.OFFBOARD: Need.ANGULAR_VELOCITY | Need.OFFBOARD_SIGNAL,
    NavState.STAB: _ATTITUDE | Need.MANUAL_CONTROL,
    NavState.AUTO_TAKEOFF: _POSITION,
    NavState.AUTO_LAND: _POSITION,
    NavState.AUTO_FOLLOW_TARGET: _GLOBAL | Need.WIND_AND_FLIGHT_TIME,
    NavState.AUTO_PRECLAND: _POSITION,
    NavState.ORBIT: _POSITION | Need.WIND_AND_FLIGHT_TIME,
    NavState.AUTO_VTOL_TAKEOFF: _POSITION,
}

PREVENT_ARMING = frozenset(
    (
        NavState.AUTO_RTL,
        NavState.AUTO_LAND,
        NavState.AUTO_PRECLAND,
        NavState.AUTO_FOLLOW_TARGET,
        NavState.DESCEND,
        NavState.TERMINATION,
        NavState.ORBIT,
        NavState.GUIDED_COURSE,
    )
)
ALL_MODES = sum(1 << state for state in NEEDS)
PREVENT_ARMING_MODES = sum(1 << state for state in PREVENT_ARMING)


def missing(flags: FailsafeFlags) -> Need:
    """Everything that a mode could need and that is not there now."""
    need = Need.OTHER
    if flags.angular_velocity_invalid:
        need |= Need.ANGULAR_VELOCITY
    if flags.attitude_invalid:
        need |= Need.ATTITUDE
    if flags.local_altitude_invalid:
        need |= Need.LOCAL_ALT
    if flags.local_position_invalid:
        need |= Need.LOCAL_POSITION
    if flags.global_position_invalid:
        need |= Need.GLOBAL_POSITION
    if flags.home_position_invalid:
        need |= Need.HOME_POSITION
    if flags.auto_mission_missing:
        need |= Need.MISSION
    if flags.offboard_control_signal_lost:
        need |= Need.OFFBOARD_SIGNAL
    if flags.manual_control_signal_lost:
        need |= Need.MANUAL_CONTROL
    if flags.wind_limit_exceeded or flags.flight_time_limit_exceeded:
        need |= Need.WIND_AND_FLIGHT_TIME
    return need


def runnable_modes(flags: FailsafeFlags) -> int:
    """Bit per NavState: everything that the mode needs is there."""
    lacking = int(missing(flags))
    modes = 0
    for state, need in _NEEDS_AS_INT:
        if not need & lacking:
            modes |= 1 << state
    return modes


_NEEDS_AS_INT = tuple((int(state), int(need)) for state, need in NEEDS.items())
