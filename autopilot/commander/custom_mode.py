"""PX4's custom_mode of the heartbeat: NavState to main and sub mode, and back.

From PX4's px4_custom_mode.h (v1.18): main mode in bits 16 to 23, sub mode in bits 24 to 31. DESCEND shows itself as
LAND, and AUTO without a sub mode means MISSION. Base mode flags are those of MAV_MODE_FLAG.
"""

from typing import Final

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES, MAIN_AUTO, ControlMode

_CUSTOM_MODE = {state: (mode.sub_mode << 24) | (mode.main_mode << 16) for state, mode in FLIGHT_MODES.items()}
_BY_MAIN_AND_SUB: Final = {
    (mode.main_mode, mode.sub_mode): state for state, mode in FLIGHT_MODES.items() if mode.by_set_mode
} | {(MAIN_AUTO, 0): NavState.AUTO_MISSION}

FLAG_CUSTOM_MODE_ENABLED: Final = 1
FLAG_AUTO_ENABLED: Final = 4
FLAG_GUIDED_ENABLED: Final = 8
FLAG_STABILIZE_ENABLED: Final = 16
FLAG_MANUAL_INPUT_ENABLED: Final = 64
FLAG_SAFETY_ARMED: Final = 128


def custom_mode_of(nav_state: NavState) -> int:
    """HEARTBEAT.custom_mode, 32 bits."""
    return _CUSTOM_MODE[nav_state]


def nav_state_of(main_mode: int, sub_mode: int) -> NavState | None:
    """The mode that DO_SET_MODE asks for; None where PX4 knows no such mode or lets nobody choose it."""
    found = _BY_MAIN_AND_SUB.get((main_mode, sub_mode))
    if found is None and main_mode != MAIN_AUTO:
        return _BY_MAIN_AND_SUB.get((main_mode, 0))  # only AUTO minds a sub mode that it does not know
    return found


def nav_state_of_base_mode(base_mode: int) -> NavState | None:
    """The mode that DO_SET_MODE asks for by MAV_MODE_FLAGs alone; None where they say nothing."""
    if base_mode & FLAG_AUTO_ENABLED:
        return NavState.AUTO_MISSION
    if not base_mode & FLAG_MANUAL_INPUT_ENABLED:
        return None
    if base_mode & FLAG_GUIDED_ENABLED:
        return NavState.POSCTL
    return NavState.STAB if base_mode & FLAG_STABILIZE_ENABLED else NavState.MANUAL


def base_mode_of(control: ControlMode, *, armed: bool) -> int:
    """HEARTBEAT.base_mode (mavlink/streams/HEARTBEAT.hpp)."""
    base_mode = FLAG_CUSTOM_MODE_ENABLED
    if control.manual:
        base_mode |= FLAG_MANUAL_INPUT_ENABLED
    if control.attitude:
        base_mode |= FLAG_STABILIZE_ENABLED
    if control.auto:
        base_mode |= FLAG_AUTO_ENABLED | FLAG_STABILIZE_ENABLED | FLAG_GUIDED_ENABLED
    return base_mode | FLAG_SAFETY_ARMED if armed else base_mode
