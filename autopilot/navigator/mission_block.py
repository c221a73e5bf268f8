"""When is an item of a mission done? PX4's MissionBlock::is_mission_item_reached_or_completed (v1.18).

A place is reached inside the acceptance radius (the item's own, else NAV_ACC_RAD) and within NAV_MC_ALT_RAD of the
height; with a yaw, also within MIS_YAW_ERR of it, where the heading is known well enough; then hold times run. What
does not fly knows no height, a rover does not hold at waypoints, and takes the radius that its control works out for a
corner where that is larger. Who stands on the ground reaches no place. LOITER_TO_ALT is flown to at the present height,
changes it on the circle that a fixed wing would fly, and is reached there; where its param4 says so, the next leg
begins at that circle's tangent. A gate is reached where its plane is passed on the way to the place behind it. Landing
is done when landed, takeoff when the height is reached. Gripper, winch and gimbal are given MIS_COMMAND_TOUT. All other
items are done at once. With MIS_YAW_TMT, a yaw is waited for only where the item insists on it, and then the mission
fails after that time, in whole seconds.
"""

import math
from typing import NamedTuple

from sitl_emu.autopilot.commands.table import Role, items_where
from sitl_emu.autopilot.constants import SetpointType, Severity
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.topics import NavigatorMissionItem
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import EARTH_RADIUS_M, MapProjection, bearing_rad, distance_m, wrap_pi

M_PER_DEG = math.radians(EARTH_RADIUS_M)

RELATIVE_FRAMES = frozenset(
    (
        mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT,
        mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT,
    )
)
RALLY_FRAMES = frozenset(
    (
        mavlink.MAV_FRAME_GLOBAL,
        mavlink.MAV_FRAME_GLOBAL_INT,
        mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
    )
)
"""Of a rally point that a return knows (RTL::extractValidSafePointPosition)."""
NAV_CMD_IDLE = 0
"""PX4's own: nothing is flown."""
WAYPOINT = mavlink.MAV_CMD_NAV_WAYPOINT
LOITER_UNLIM = mavlink.MAV_CMD_NAV_LOITER_UNLIM
LOITER_TIME = mavlink.MAV_CMD_NAV_LOITER_TIME
LOITER_TO_ALT = mavlink.MAV_CMD_NAV_LOITER_TO_ALT
LAND = mavlink.MAV_CMD_NAV_LAND
TAKEOFF = mavlink.MAV_CMD_NAV_TAKEOFF
VTOL_TAKEOFF = mavlink.MAV_CMD_NAV_VTOL_TAKEOFF
VTOL_LAND = mavlink.MAV_CMD_NAV_VTOL_LAND
RETURN_TO_LAUNCH = mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH
DELAY = mavlink.MAV_CMD_NAV_DELAY
WAITED_FOR = frozenset(
    (mavlink.MAV_CMD_DO_GRIPPER, mavlink.MAV_CMD_DO_WINCH, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW)
)
"""For MIS_COMMAND_TOUT, whatever becomes of them."""
TAKEOFFS = frozenset((TAKEOFF, VTOL_TAKEOFF))
LANDS = frozenset((LAND, VTOL_LAND))
GATE = mavlink.MAV_CMD_CONDITION_GATE
WITH_POSITION = items_where(lambda item: item.role is Role.PLACE)
WITH_HEADING = items_where(lambda item: item.heading)

SAME_HEIGHT_M = 1e-6
EXIT_MARGIN = 1.05
"""A circle whose next place is nearer than so many of its radii can't be left towards it (exit_course_is_reachable)."""
EXIT_COURSE_COSINE = 0.99619
"""Of 5 degrees (kCosineExitCourseThreshold)."""
STOPPED_DESCENT_M = 2.0
"""A descent of less is not stopped (kAltitudeDifferenceForDescentCondition)."""
OF_PLAN, ONBOARD = 0, 1
"""navigator_mission_item.origin."""


class Target(NamedTuple):
    """A mission item as it is flown: degrees, metres AMSL, radians, seconds."""

    command: int
    lat_deg: float = math.nan
    lon_deg: float = math.nan
    alt_m: float = math.nan
    yaw_rad: float = math.nan
    acceptance_radius_m: float = 0.0
    hold_s: float = 0.0
    autocontinue: bool = True
    force_heading: bool = False
    loiter_radius_m: float = 0.0
    """Of the circle that a fixed wing would fly, below 0 to the left; 0 or NaN: NAV_LOITER_RAD."""
    above_home_m: float = math.nan
    """NaN: the altitude does not count from home."""
    loiter_exit_xtrack: bool = False
    """The circle is left where its tangent leads to the next place."""


def target_of(item: MissionItem, home_alt_m: float) -> Target:
    """The item with its altitude made absolute; `home_alt_m` is AMSL."""
    if item.command not in WITH_POSITION:
        hold_s = item.param1 if item.command == DELAY and math.isfinite(item.param1) else 0.0
        return Target(item.command, item.lat_deg, item.lon_deg, hold_s=hold_s, autocontinue=bool(item.autocontinue))
    above_home_m = item.z if item.frame in RELATIVE_FRAMES else math.nan
    yaw_deg = item.param4 if item.command in WITH_HEADING else math.nan
    yaw_rad = math.radians(yaw_deg) % math.tau  # as PX4 keeps it (wrap_2pi in parse_mavlink_mission_item)
    return Target(
        item.command,
        item.lat_deg,
        item.lon_deg,
        item.z + home_alt_m if item.frame in RELATIVE_FRAMES else item.z,
        yaw_rad,
        item.param2 if item.command == WAYPOINT and math.isfinite(item.param2) else 0.0,
        item.param1 if item.command in (WAYPOINT, LOITER_TIME) and math.isfinite(item.param1) else 0.0,
        bool(item.autocontinue),
        (item.command == LOITER_TIME and item.param2 > 0.0) or (item.command == LOITER_TO_ALT and item.param1 > 0.0),
        _loiter_radius_m(item),
        above_home_m,
        item.command in (LOITER_TIME, LOITER_TO_ALT) and item.param4 > 0.0,
    )


def _loiter_radius_m(item: MissionItem) -> float:
    if item.command == LOITER_TO_ALT:
        return item.param2
    return item.param3 if item.command in (LOITER_UNLIM, LOITER_TIME) else 0.0


def loiter_radius_m(state: NavigatorState, target: Target) -> float:
    """The radius of a target's circle, whichever way round."""
    radius_m = abs(target.loiter_radius_m)
    return radius_m if math.isfinite(radius_m) and radius_m > 0.0 else state.settings.nav_loiter_rad_m


def tell_item(
    state: NavigatorState, seq: int, target: Target, item: MissionItem | None = None, *, as_planned: bool = True
) -> None:
    """Tell the log what is flown now (navigator_mission_item): an item of the plan, or one made on board.

    What is made of a plan's item (not `as_planned`: a climb before it) is still the plan's, at an absolute height.
    """
    as_planned = as_planned and item is not None
    radius_m = target.acceptance_radius_m if item is not None else state.acceptance_radius_m()
    state.topics.navigator_mission_item = NavigatorMissionItem(
        state.now_us,
        seq,
        target.command,
        target.lat_deg,
        target.lon_deg,
        item.z if as_planned and item is not None else target.alt_m,
        target.hold_s,
        radius_m,
        target.loiter_radius_m,
        target.yaw_rad,
        0 if item is None else item.frame,
        ONBOARD if item is None else OF_PLAN,
        loiter_exit_xtrack=target.loiter_exit_xtrack,
        force_heading=target.force_heading,
        altitude_is_relative=as_planned and item is not None and item.frame in RELATIVE_FRAMES,
        autocontinue=target.autocontinue,
    )


def tell_command(state: NavigatorState, seq: int, item: MissionItem) -> None:
    """The same of an item without a place: its parameters lie where a place's radius, circle and yaw do."""
    in_global = item.frame != mavlink.MAV_FRAME_MISSION
    state.topics.navigator_mission_item = NavigatorMissionItem(
        state.now_us,
        seq,
        item.command,
        item.lat_deg if in_global else 0.0,
        item.lon_deg if in_global else 0.0,
        item.z,
        target_of(item, state.home_alt_m()).hold_s,
        item.param2,
        item.param3,
        item.param4,
        item.frame,
        OF_PLAN,
        altitude_is_relative=item.frame in RELATIVE_FRAMES,
        autocontinue=bool(item.autocontinue),
    )


def keep_off_ground(state: NavigatorState, target: Target) -> Target:
    """NAV_MIN_GND_DIST: a descent that comes nearer to the ground than this ends where it is.

    PX4's updateAltToAvoidTerrainCollisionAndRepublishTriplet.
    """
    local, alt_m = state.topics.vehicle_local_position, state.position.alt
    is_near = local.dist_bottom_valid and local.dist_bottom < state.settings.nav_min_gnd_dist_m
    if not is_near or state.settings.nav_min_gnd_dist_m <= 0.0 or local.vz <= 0.0:
        return target
    descends = target.command in WITH_POSITION - LANDS and alt_m - target.alt_m > STOPPED_DESCENT_M
    if not descends:
        return target
    text = "Terrain collision risk, descent is stopped\t"
    state.say(Severity.CRITICAL, text, "navigator_terrain_collision_risk")
    triplet = state.triplet
    current = triplet.current._replace(timestamp=state.now_us, alt=alt_m)
    state.triplet = triplet._replace(timestamp=state.now_us, current=current)
    return target._replace(alt_m=alt_m, above_home_m=math.nan)


class Reached:
    """Watches one target until it is done."""

    def __init__(self) -> None:
        self._position_reached = self._yaw_reached = False
        self._position_reached_us = 0
        self._started_us = -1
        self._planned: Target | None = None
        self._m_per_deg_lon = M_PER_DEG

    def restart(self, now_us: int) -> None:
        """A new target begins."""
        self._position_reached = self._yaw_reached = False
        self._position_reached_us = 0
        self._started_us = now_us

    def update(self, state: NavigatorState, target: Target) -> bool:
        """Whether the target is done."""
        command = target.command
        if command in LANDS:
            return state.landed
        if command == LOITER_UNLIM:
            return False
        if command == DELAY:
            return (state.now_us - self._started_us) * 1e-6 >= target.hold_s
        if command in WAITED_FOR:
            limit_s = state.settings.mis_command_tout_s
            # 0 has passed when the navigator wakes itself for the next item, which takes it some microseconds in PX4.
            return limit_s <= 0.0 or (state.now_us - self._started_us) * 1e-6 > limit_s
        if command not in WITH_POSITION and command != GATE:
            return True
        if not self._position_reached:
            if not self._is_there(state, target):
                return False
            self._position_reached = True
            self._position_reached_us = state.now_us
        self._yaw_reached = self._yaw_reached or self._yaw_is_there(state, target)
        if not self._yaw_reached:
            return False
        passes = command == WAYPOINT and not state.traits.stops_at_waypoints
        hold_s = 0.0 if passes else max(target.hold_s, 0.0)
        if (state.now_us - self._position_reached_us) * 1e-6 < hold_s or not _may_leave(state, target):
            return False
        if target.loiter_exit_xtrack:
            _leave_on_tangent(state)
        return True

    def _is_there(self, state: NavigatorState, target: Target) -> bool:
        position = state.position
        if not position.valid or state.landed:
            return False
        if target.command == GATE:
            return _is_passed(state, target)
        flies, away_m = state.traits.flies, self._away_m(target, position.lat, position.lon)
        tolerance_m = state.altitude_acceptance_m()
        if target.command == LOITER_TO_ALT:
            circle_m = state.acceptance_radius_m() + loiter_radius_m(state, target)
            return away_m <= circle_m and _is_at_height(state, target.alt_m, tolerance_m)
        if target.command in TAKEOFFS and flies:
            climb_m = target.alt_m - state.home_alt_m()
            if 0.0 < climb_m < tolerance_m:
                tolerance_m = climb_m / 2.0
            return position.alt > target.alt_m - tolerance_m
        own_m = target.acceptance_radius_m if flies else 0.0
        radius_m = own_m if own_m > 0.0 else state.acceptance_radius_m()
        return away_m <= radius_m and abs(target.alt_m - position.alt) <= tolerance_m

    def _away_m(self, target: Target, lat_deg: float, lon_deg: float) -> float:
        """Distance on a plane at the target: exact enough near it, and quick."""
        if target is not self._planned:
            self._planned = target
            self._m_per_deg_lon = M_PER_DEG * math.cos(math.radians(target.lat_deg))
        return math.hypot((lat_deg - target.lat_deg) * M_PER_DEG, (lon_deg - target.lon_deg) * self._m_per_deg_lon)

    def _yaw_is_there(self, state: NavigatorState, target: Target) -> bool:
        turns = state.traits.stops_at_waypoints and target.command not in TAKEOFFS | {GATE}
        if not turns or target.yaw_rad != target.yaw_rad:
            return True
        settings, local = state.settings, state.topics.vehicle_local_position
        if not local.heading_good_for_control:
            return True
        error = abs(wrap_pi(target.yaw_rad - local.heading))
        if error < settings.mis_yaw_err_rad:
            return True
        if settings.mis_yaw_tmt_s <= 0.0:
            return False
        waited_s = (state.now_us - self._position_reached_us) * 1e-6
        limit_s = math.floor(settings.mis_yaw_tmt_s)
        if target.force_heading and waited_s >= limit_s and not state.mission_failure:
            state.mission_failure = True
            text = "unable to reach heading within timeout\t"
            state.say(Severity.CRITICAL, text, "navigator_mission_failure_heading")
        return not target.force_heading


def _is_at_height(state: NavigatorState, alt_m: float, tolerance_m: float) -> bool:
    """LOITER_TO_ALT, on its circle: there at the height of its setpoint, which becomes the item's then, or at that."""
    triplet, now_us = state.triplet, state.now_us
    if abs(triplet.current.alt - state.position.alt) > tolerance_m:
        return False
    if abs(triplet.current.alt - alt_m) < SAME_HEIGHT_M:
        return True
    current = triplet.current._replace(timestamp=now_us, alt=alt_m, type=int(SetpointType.LOITER))
    state.triplet = triplet._replace(timestamp=now_us, current=current)
    return False


def _is_passed(state: NavigatorState, gate: Target) -> bool:
    """Whether the vehicle is beyond the gate, seen towards what it flies to; not where that is in the gate itself."""
    current, position = state.triplet.current, state.position
    if not current.valid:
        return False
    plane = MapProjection(gate.lat_deg, gate.lon_deg)
    there_n, there_e = plane.project(current.lat, current.lon)
    here_n, here_e = plane.project(position.lat, position.lon)
    return (there_n != 0.0 or there_e != 0.0) and here_n * there_n + here_e * there_e >= 0.0


def _may_leave(state: NavigatorState, target: Target) -> bool:
    """What does not hover leaves a circle, if its item has a heading, on course for the next place."""
    current, following = state.triplet.current, state.triplet.next
    circles = current.type == SetpointType.LOITER and (target.force_heading or target.command == WAYPOINT)
    if state.traits.flies or not following.valid or not circles:
        return True
    there = following.lat, following.lon
    if distance_m(current.lat, current.lon, *there) <= EXIT_MARGIN * current.loiter_radius:
        return True
    position, local = state.position, state.topics.vehicle_local_position
    away_m, course_rad = distance_m(position.lat, position.lon, *there), bearing_rad(position.lat, position.lon, *there)
    ahead_m_s = local.vx * math.cos(course_rad) + local.vy * math.sin(course_rad)
    return away_m * ahead_m_s > away_m * math.hypot(local.vx, local.vy) * EXIT_COURSE_COSINE


def _leave_on_tangent(state: NavigatorState) -> None:
    """The setpoint moves to where a fixed wing would leave its circle; the next leg begins there, whoever flies it."""
    triplet = state.triplet
    current, following = triplet.current, triplet.next
    if not following.valid:
        return
    centre, there = (current.lat, current.lon), (following.lat, following.lon)
    away_m, radius_m = distance_m(*centre, *there), abs(current.loiter_radius)
    inner_rad = math.acos(radius_m / away_m) if radius_m < away_m else 0.0
    turn_rad = inner_rad if current.loiter_direction_counter_clockwise else -inner_rad
    exit_rad = bearing_rad(*centre, *there) + turn_rad
    lat, lon = MapProjection(*centre).reproject(radius_m * math.cos(exit_rad), radius_m * math.sin(exit_rad))
    state.triplet = triplet._replace(
        timestamp=state.now_us, current=current._replace(type=int(SetpointType.POSITION), lat=lat, lon=lon)
    )
