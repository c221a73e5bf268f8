"""What PX4 calls its modes in texts (mode_names of src/lib/modes/ui.hpp, v1.18), and their numbers in events."""

from autopilot.constants import NavState

MODE_NAMES: dict[NavState, str] = {
    NavState.MANUAL: "Manual",
    NavState.ALTCTL: "Altitude",
    NavState.POSCTL: "Position",
    NavState.AUTO_MISSION: "Mission",
    NavState.AUTO_LOITER: "Hold",
    NavState.AUTO_RTL: "Return",
    NavState.POSITION_SLOW: "Position Slow",
    NavState.GUIDED_COURSE: "Guided Course",
    NavState.ALTITUDE_CRUISE: "Altitude Cruise",
    NavState.ACRO: "Acro",
    NavState.DESCEND: "Descend",
    NavState.TERMINATION: "Termination",
    NavState.OFFBOARD: "Offboard",
    NavState.STAB: "Stabilized",
    NavState.AUTO_TAKEOFF: "Takeoff",
    NavState.AUTO_LAND: "Land",
    NavState.AUTO_FOLLOW_TARGET: "Follow Target",
    NavState.AUTO_PRECLAND: "Precision Landing",
    NavState.ORBIT: "Orbit",
    NavState.AUTO_VTOL_TAKEOFF: "VTOL Takeoff",
    **{NavState(number): f"External {number - 22}" for number in range(NavState.EXTERNAL1, NavState.EXTERNAL8 + 1)},
}

NAVIGATION_MODES: dict[NavState, int] = {
    NavState.MANUAL: 0,
    NavState.ALTCTL: 1,
    NavState.POSCTL: 2,
    NavState.AUTO_MISSION: 3,
    NavState.AUTO_LOITER: 4,
    NavState.AUTO_RTL: 5,
    NavState.ACRO: 6,
    NavState.OFFBOARD: 7,
    NavState.STAB: 8,
    NavState.POSITION_SLOW: 9,
    NavState.AUTO_TAKEOFF: 10,
    NavState.AUTO_LAND: 11,
    NavState.AUTO_FOLLOW_TARGET: 12,
    NavState.AUTO_PRECLAND: 13,
    NavState.ORBIT: 14,
    NavState.AUTO_VTOL_TAKEOFF: 15,
    **{NavState(number): number - 7 for number in range(NavState.EXTERNAL1, NavState.EXTERNAL8 + 1)},
    NavState.ALTITUDE_CRUISE: 24,
    NavState.GUIDED_COURSE: 25,
}
"""Enum navigation_mode_t of the events."""
NAVIGATION_MODE_UNKNOWN = 255
