"""Can this mission be flown? What matters of PX4's FeasibilityChecker (MissionFeasibility, v1.18).

Refused: no item to fly, a takeoff that is not the first place, a first waypoint further than MIS_DIST_1WP, a landing
first, jumps that end nowhere. Missing takeoff or landing is refused only by MIS_TKO_LAND_REQ.
"""

import math

from autopilot.dataman import MissionItem
from autopilot.navigator.mission_block import LANDS, PLACED, RETURN_TO_LAUNCH, TAKEOFFS
from autopilot.navigator.state import NavigatorState
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import distance_m

REQUIRE_TAKEOFF = (1, 3, 4)
REQUIRE_LANDING = (2, 3)


def problem(state: NavigatorState, items: tuple[MissionItem, ...]) -> str | None:
    """PX4's text for the first thing that is wrong; None for a mission that can be flown."""
    placed = [item for item in items if item.command in PLACED]
    if not items:
        return "No mission"
    settings = state.settings
    if not state.rover:
        if placed and placed[0].command in LANDS and state.landed:
            return "Mission rejected: starts with landing\t"
        if any(item.command in TAKEOFFS for item in placed[1:]) and placed[0].command not in TAKEOFFS:
            return "Mission rejected: takeoff is not the first waypoint item\t"
    if settings.mis_tko_land_req in REQUIRE_TAKEOFF and not any(item.command in TAKEOFFS for item in placed):
        return "Mission rejected: Takeoff waypoint required\t"
    ends = any(item.command in LANDS or item.command == RETURN_TO_LAUNCH for item in items)
    if settings.mis_tko_land_req in REQUIRE_LANDING and not ends:
        return "Mission rejected: Landing waypoint/pattern required\t"
    for item in items:
        if item.command == mavlink.MAV_CMD_DO_JUMP and not 0 <= item.param1 < len(items):
            return "Mission rejected: Invalid jump target\t"
    return _too_far(state, placed)


def _too_far(state: NavigatorState, placed: list[MissionItem]) -> str | None:
    position, limit_m = state.position, state.settings.mis_dist_1wp_m
    if limit_m <= 0.0 or not placed or not position.valid:
        return None
    first = placed[0]
    away_m = distance_m(first.lat_deg, first.lon_deg, position.lat, position.lon)
    if math.isfinite(away_m) and away_m > limit_m:
        return f"First waypoint far away from vehicle: {away_m:.0f} m\t"
    return None
