"""The modes that AVAILABLE_MODES lists, in PX4 v1.18's order (https://mavlink.io/en/services/standard_modes.html)."""

from typing import NamedTuple

from autopilot.constants import NavState
from autopilot.vehicle_kind import Traits

ADVANCED = 1
NOT_USER_SELECTABLE = 2
"""MAV_MODE_PROPERTY."""

ALTITUDE_HOLD, POSITION_HOLD, ORBIT = 4, 1, 2
SAFE_RECOVERY, MISSION, LAND, TAKEOFF = 5, 6, 7, 8
"""MAV_STANDARD_MODE."""

STANDARD_MODE = {
    NavState.ALTCTL: ALTITUDE_HOLD,
    NavState.POSCTL: POSITION_HOLD,
    NavState.AUTO_MISSION: MISSION,
    NavState.AUTO_RTL: SAFE_RECOVERY,
    NavState.AUTO_TAKEOFF: TAKEOFF,
    NavState.AUTO_LAND: LAND,
    NavState.ORBIT: ORBIT,
}
"""The modes that have one; every other mode is 0, non-standard (Hold among them)."""
NAMES = {ALTITUDE_HOLD: "Altitude", POSITION_HOLD: "Position", ORBIT: "Orbit"}
"""What standard modes are called where they are none (Traits.no_standard_modes)."""


class Mode(NamedTuple):
    """One entry; a standard mode has no name of its own."""

    custom_mode: int
    properties: int
    standard_mode: int
    name: str


def _mode(main: int, sub: int, properties: int, name: str, standard_mode: int = 0) -> Mode:
    return Mode(main << 16 | sub << 24, properties, standard_mode, name)


MODES: tuple[Mode, ...] = (
    _mode(1, 0, ADVANCED, "Manual"),
    _mode(2, 0, 0, "", ALTITUDE_HOLD),
    _mode(3, 0, 0, "", POSITION_HOLD),
    _mode(4, 4, ADVANCED, "", MISSION),
    _mode(4, 3, ADVANCED, "Hold"),
    _mode(4, 5, ADVANCED, "", SAFE_RECOVERY),
    _mode(3, 2, ADVANCED, "Position Slow"),
    _mode(4, 19, ADVANCED, "Guided Course"),
    _mode(11, 0, ADVANCED, "Altitude Cruise"),
    _mode(5, 0, ADVANCED, "Acro"),
    _mode(10, 0, ADVANCED | NOT_USER_SELECTABLE, "Termination"),
    _mode(6, 0, ADVANCED, "Offboard"),
    _mode(7, 0, ADVANCED, "Stabilized"),
    _mode(4, 2, ADVANCED, "", TAKEOFF),
    _mode(4, 6, ADVANCED, "", LAND),
    _mode(4, 8, ADVANCED, "Follow Target"),
    _mode(4, 9, ADVANCED, "Precision Landing"),
    _mode(3, 1, ADVANCED, "", ORBIT),
    _mode(4, 10, ADVANCED, "VTOL Takeoff"),
    *(_mode(4, sub, NOT_USER_SELECTABLE, "(Mode not available)") for sub in range(11, 19)),
)


def listed(index: int, traits: Traits) -> Mode:
    """Mode `index`, counted from 1, as a kind of vehicle lists it."""
    mode = MODES[index - 1]
    if mode.standard_mode in {STANDARD_MODE[state] for state in traits.no_standard_modes}:
        return mode._replace(standard_mode=0, name=NAMES[mode.standard_mode])
    return mode


def standard_mode_of(nav_state: NavState, traits: Traits) -> int:
    """MAV_STANDARD_MODE of a mode; 0 where it is none."""
    return 0 if nav_state in traits.no_standard_modes else STANDARD_MODE.get(nav_state, 0)
