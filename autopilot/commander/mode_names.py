"""What PX4 calls its modes in texts (mode_names of src/lib/modes/ui.hpp, v1.18)."""

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
