"""Can this mission be flown? What matters of PX4's FeasibilityChecker (MissionFeasibility, v1.18).

Refused: no item to fly, a takeoff that is not the first place, a landing first, jumps that end nowhere. Missing takeoff
or landing is refused only by MIS_TKO_LAND_REQ. A first waypoint beyond MIS_DIST_1WP is not refused by PX4 either.
"""

from autopilot.dataman import MissionItem
from autopilot.navigator.mission_block import LANDS, PLACED, RETURN_TO_LAUNCH, TAKEOFFS
from autopilot.navigator.state import NavigatorState
from sitl_emu.core import dialect as mavlink

TAKEOFF_NOT_FIRST = "Mission rejected: takeoff is not the first waypoint item\t"
TAKEOFF_MISSING = "Mission rejected: Takeoff waypoint required\t"
LANDING_MISSING = "Mission rejected: Landing waypoint/pattern required\t"
EVENTS = {
    TAKEOFF_NOT_FIRST: "navigator_mis_takeoff_not_first",
    TAKEOFF_MISSING: "navigator_mis_takeoff_missing",
    LANDING_MISSING: "navigator_mis_land_missing",
}
"""The event of each text that has one."""
REQUIRE_TAKEOFF = (1, 3, 4)
REQUIRE_LANDING = (2, 3)


def problem(state: NavigatorState, items: tuple[MissionItem, ...]) -> str | None:
    """PX4's text for the first thing that is wrong (empty: PX4 says nothing); None for a mission that can be flown."""
    placed = [item for item in items if item.command in PLACED]
    if not items:
        return ""
    settings = state.settings
    if placed and placed[0].command in LANDS and state.landed:
        return ""
    takes_off_later = any(item.command in TAKEOFFS for item in placed[1:])
    if takes_off_later and placed[0].command not in TAKEOFFS and not state.rover:
        return TAKEOFF_NOT_FIRST
    if settings.mis_tko_land_req in REQUIRE_TAKEOFF and not any(item.command in TAKEOFFS for item in placed):
        return TAKEOFF_MISSING
    ends = any(item.command in LANDS or item.command == RETURN_TO_LAUNCH for item in items)
    if settings.mis_tko_land_req in REQUIRE_LANDING and not ends:
        return LANDING_MISSING
    for item in items:
        if item.command == mavlink.MAV_CMD_DO_JUMP and not 0 <= item.param1 < len(items):
            return "Mission rejected: Invalid jump target\t"
    return None
