"""PX4's custom_mode of the heartbeat: NavState to main and sub mode, and back.

From PX4's px4_custom_mode.h (v1.18): main mode in bits 16 to 23, sub mode in bits 24 to 31. DESCEND shows itself as
LAND, and AUTO without a sub mode means MISSION. Base mode flags are those of MAV_MODE_FLAG.
"""

from autopilot.constants import NavState
from autopilot.vehicle_kind import Traits

MAIN_MANUAL = 1
MAIN_ALTCTL = 2
MAIN_POSCTL = 3
MAIN_AUTO = 4
MAIN_ACRO = 5
MAIN_OFFBOARD = 6
MAIN_STABILIZED = 7
MAIN_TERMINATION = 10
MAIN_ALTITUDE_CRUISE = 11

SUB_POSCTL_SLOW = 2
EXTERNAL_MODES = tuple(NavState(number) for number in range(NavState.EXTERNAL1, NavState.EXTERNAL8 + 1))

MAIN_AND_SUB: dict[NavState, tuple[int, int]] = {
    NavState.MANUAL: (MAIN_MANUAL, 0),
    NavState.ALTCTL: (MAIN_ALTCTL, 0),
    NavState.POSCTL: (MAIN_POSCTL, 0),
    NavState.ORBIT: (MAIN_POSCTL, 1),
    NavState.POSITION_SLOW: (MAIN_POSCTL, SUB_POSCTL_SLOW),
    NavState.AUTO_TAKEOFF: (MAIN_AUTO, 2),
    NavState.AUTO_LOITER: (MAIN_AUTO, 3),
    NavState.AUTO_MISSION: (MAIN_AUTO, 4),
    NavState.AUTO_RTL: (MAIN_AUTO, 5),
    NavState.AUTO_LAND: (MAIN_AUTO, 6),
    NavState.DESCEND: (MAIN_AUTO, 6),
    NavState.AUTO_FOLLOW_TARGET: (MAIN_AUTO, 8),
    NavState.AUTO_PRECLAND: (MAIN_AUTO, 9),
    NavState.AUTO_VTOL_TAKEOFF: (MAIN_AUTO, 10),
    NavState.GUIDED_COURSE: (MAIN_AUTO, 19),
    NavState.ACRO: (MAIN_ACRO, 0),
    NavState.OFFBOARD: (MAIN_OFFBOARD, 0),
    NavState.STAB: (MAIN_STABILIZED, 0),
    NavState.TERMINATION: (MAIN_TERMINATION, 0),
    NavState.ALTITUDE_CRUISE: (MAIN_ALTITUDE_CRUISE, 0),
    **{state: (MAIN_AUTO, 11 + index) for index, state in enumerate(EXTERNAL_MODES)},
}
_CUSTOM_MODE = {state: (sub << 24) | (main << 16) for state, (main, sub) in MAIN_AND_SUB.items()}

_AUTO_SELECTABLE = {
    MAIN_AND_SUB[state][1]: state
    for state in (
        NavState.AUTO_TAKEOFF,
        NavState.AUTO_LOITER,
        NavState.AUTO_MISSION,
        NavState.AUTO_RTL,
        NavState.AUTO_LAND,
        NavState.AUTO_FOLLOW_TARGET,
        NavState.AUTO_PRECLAND,
        NavState.GUIDED_COURSE,
        *EXTERNAL_MODES,
    )
} | {0: NavState.AUTO_MISSION}
_MAIN_SELECTABLE = {
    MAIN_MANUAL: NavState.MANUAL,
    MAIN_ALTCTL: NavState.ALTCTL,
    MAIN_ACRO: NavState.ACRO,
    MAIN_OFFBOARD: NavState.OFFBOARD,
    MAIN_STABILIZED: NavState.STAB,
    MAIN_ALTITUDE_CRUISE: NavState.ALTITUDE_CRUISE,
}

FLAG_CUSTOM_MODE_ENABLED = 1
FLAG_AUTO_ENABLED = 4
FLAG_GUIDED_ENABLED = 8
FLAG_STABILIZE_ENABLED = 16
FLAG_MANUAL_INPUT_ENABLED = 64
FLAG_SAFETY_ARMED = 128

_STICKS = FLAG_CUSTOM_MODE_ENABLED | FLAG_STABILIZE_ENABLED | FLAG_MANUAL_INPUT_ENABLED
_BY_ITSELF = FLAG_CUSTOM_MODE_ENABLED | FLAG_STABILIZE_ENABLED
_AUTO = _BY_ITSELF | FLAG_GUIDED_ENABLED | FLAG_AUTO_ENABLED
_BASE_MODE = {
    **dict.fromkeys(NavState, _BY_ITSELF),
    **dict.fromkeys(
        (
            NavState.AUTO_TAKEOFF,
            NavState.AUTO_LOITER,
            NavState.AUTO_MISSION,
            NavState.AUTO_RTL,
            NavState.AUTO_LAND,
            NavState.AUTO_PRECLAND,
            NavState.AUTO_VTOL_TAKEOFF,
            NavState.GUIDED_COURSE,
        ),
        _AUTO,
    ),
    **dict.fromkeys(
        (
            NavState.MANUAL,
            NavState.ALTCTL,
            NavState.POSCTL,
            NavState.POSITION_SLOW,
            NavState.ALTITUDE_CRUISE,
            NavState.STAB,
        ),
        _STICKS,
    ),
    NavState.ACRO: FLAG_CUSTOM_MODE_ENABLED | FLAG_MANUAL_INPUT_ENABLED,
    NavState.TERMINATION: FLAG_CUSTOM_MODE_ENABLED,
    NavState.OFFBOARD: FLAG_CUSTOM_MODE_ENABLED,
}


def custom_mode_of(nav_state: NavState) -> int:
    """HEARTBEAT.custom_mode, 32 bits."""
    return _CUSTOM_MODE[nav_state]


def nav_state_of(main_mode: int, sub_mode: int) -> NavState | None:
    """The mode that DO_SET_MODE asks for; None where PX4 knows no such mode or lets nobody choose it."""
    if main_mode == MAIN_AUTO:
        return _AUTO_SELECTABLE.get(sub_mode)
    if main_mode == MAIN_POSCTL:
        return NavState.POSITION_SLOW if sub_mode == SUB_POSCTL_SLOW else NavState.POSCTL
    return _MAIN_SELECTABLE.get(main_mode)


def nav_state_of_base_mode(base_mode: int) -> NavState | None:
    """The mode that DO_SET_MODE asks for by MAV_MODE_FLAGs alone; None where they say nothing."""
    if base_mode & FLAG_AUTO_ENABLED:
        return NavState.AUTO_MISSION
    if not base_mode & FLAG_MANUAL_INPUT_ENABLED:
        return None
    if base_mode & FLAG_GUIDED_ENABLED:
        return NavState.POSCTL
    return NavState.STAB if base_mode & FLAG_STABILIZE_ENABLED else NavState.MANUAL


def base_mode_of(nav_state: NavState, *, armed: bool, traits: Traits, offboard_attitude: bool) -> int:
    """HEARTBEAT.base_mode. MANUAL stabilizes some kinds; OFFBOARD does if its last setpoint wanted that."""
    base_mode = _BASE_MODE[nav_state]
    if nav_state is NavState.OFFBOARD and offboard_attitude:
        base_mode |= FLAG_STABILIZE_ENABLED
    if nav_state is NavState.MANUAL and not traits.manual_controls_attitude:
        base_mode &= ~FLAG_STABILIZE_ENABLED
    return base_mode | FLAG_SAFETY_ARMED if armed else base_mode
