"""Can this mission be flown? PX4's MissionFeasibilityChecker and FeasibilityChecker (v1.18).

What is wrong is told as an event only, as PX4's checker has no way to the texts; a breach of the fence has both. The
first unfit item ends the checks of items. A first waypoint beyond MIS_DIST_1WP is told, and flown. What concerns fixed
wings and VTOL alone is left out.
"""

from sitl_emu.autopilot.commands.table import items_where
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.navigator.geofence import Geofence
from sitl_emu.autopilot.navigator.mission_block import LAND, RELATIVE_FRAMES, TAKEOFFS, WITH_POSITION
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import distance_m

VTOL_ITEMS = frozenset(
    (mavlink.MAV_CMD_NAV_VTOL_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_LAND, mavlink.MAV_CMD_DO_VTOL_TRANSITION)
)
BEFORE_TAKEOFF = items_where(lambda item: item.before_takeoff)
FEASIBLE = items_where(lambda item: item.feasible)
TAKEOFF_REQUIRED, LANDING_REQUIRED, BOTH_REQUIRED, BOTH_OR_NONE, LANDING_IN_AIR = 1, 2, 3, 4, 5
"""MIS_TKO_LAND_REQ."""
PARAMETERS = ("FW_LND_ANG", "MIS_DIST_1WP", "MIS_TKO_LAND_REQ")
"""What PX4 looks for at the first check (FeasibilityChecker::updateData), so that it is announced from then on."""


def is_feasible(state: NavigatorState, geofence: Geofence, items: tuple[MissionItem, ...]) -> bool:
    """Whether it can; if not, says why. A mission without items cannot, which goes without saying."""
    if not items:
        return False
    if not state.topics.home_position.valid:
        text = "Not yet ready for mission, no position lock.\t"
        state.say(Severity.INFO, text, "navigator_mis_no_pos_lock")
        return False
    state.parameters.use(PARAMETERS)
    fits = _items_fit(state, items)
    return _is_within(state, geofence, items) and fits


def _items_fit(state: NavigatorState, items: tuple[MissionItem, ...]) -> bool:
    first_is_far = takeoff_is_wrong = vtol_items = False
    has_takeoff = has_landing = has_position = False
    for number, item in enumerate(items, start=1):
        command = item.command
        if command not in FEASIBLE:
            state.say(Severity.ERROR, "", "navigator_mis_unsup_cmd", number, command)
            return False
        if number == 1 and command == LAND and state.landed:
            state.say(Severity.ERROR, "", "navigator_mis_starts_w_landing")
            return False
        if command in WITH_POSITION and not first_is_far:
            first_is_far = True
            _tell_of_distance(state, item)
        if not takeoff_is_wrong:
            if command in TAKEOFFS:
                takeoff_is_wrong = not _takeoff_fits(state, item, has_position)
                has_takeoff = has_takeoff or not _is_too_low(state, item)
            has_position = has_position or command not in BEFORE_TAKEOFF
        if command in VTOL_ITEMS and not vtol_items:
            vtol_items = True
            state.say(Severity.ERROR, "", "navigator_mis_vtol_items")
        has_landing = has_landing or (command == LAND and state.traits.flies)
    complete = _has_takeoff_and_landing(state, has_takeoff=has_takeoff, has_landing=has_landing)
    return complete and not takeoff_is_wrong and not vtol_items


def _tell_of_distance(state: NavigatorState, item: MissionItem) -> None:
    home, limit_m = state.topics.home_position, state.settings.mis_dist_1wp_m
    away_m = distance_m(item.lat_deg, item.lon_deg, home.lat, home.lon)
    if 0.0 < limit_m <= away_m:
        state.say(Severity.WARNING, "", "navigator_mis_first_wp_far", away_m)


def _takeoff_fits(state: NavigatorState, item: MissionItem, after_position: bool) -> bool:
    if _is_too_low(state, item):
        lowest_m = 0.0 if item.frame in RELATIVE_FRAMES else state.home_alt_m()
        state.say(Severity.ERROR, "", "navigator_mis_takeoff_too_low", lowest_m)
        return False
    if after_position:
        state.say(Severity.ERROR, "", "navigator_mis_takeoff_not_first")
        return False
    return True


def _is_too_low(state: NavigatorState, item: MissionItem) -> bool:
    return item.z <= (0.0 if item.frame in RELATIVE_FRAMES else state.home_alt_m())


def _has_takeoff_and_landing(state: NavigatorState, *, has_takeoff: bool, has_landing: bool) -> bool:
    required, event = state.settings.mis_tko_land_req, ""
    if required == TAKEOFF_REQUIRED and not has_takeoff:
        event = "navigator_mis_takeoff_missing"
    elif required == LANDING_REQUIRED and not has_landing:
        event = "navigator_mis_land_missing"
    elif required == BOTH_REQUIRED and not (has_takeoff and has_landing):
        event = "navigator_mis_takeoff_or_land_missing"
    elif required == LANDING_IN_AIR and not state.landed:
        event = "" if has_landing else "feasibility_mis_in_air_landing_req"
    elif required in (BOTH_OR_NONE, LANDING_IN_AIR) and has_takeoff != has_landing:
        event = "navigator_mis_add_land_or_rm_to" if has_takeoff else "navigator_mis_add_to_or_rm_land"
    if event:
        state.say(Severity.ERROR, "", event)
    return not event


def _is_within(state: NavigatorState, geofence: Geofence, items: tuple[MissionItem, ...]) -> bool:
    home_alt_m = state.home_alt_m()
    for number, item in enumerate(items, start=1):
        if item.command not in WITH_POSITION:
            continue
        alt_m = item.z + home_alt_m if item.frame in RELATIVE_FRAMES else item.z
        if not geofence.allows(item.lat_deg, item.lon_deg, alt_m):
            text = f"Geofence violation for waypoint {number}\t"
            state.say(Severity.CRITICAL, text, "navigator_mis_geofence_violation", number)
            return False
    return True
