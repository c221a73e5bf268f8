"""When is an item of a mission done? PX4's MissionBlock::is_mission_item_reached_or_completed (v1.18).

A place is reached inside the acceptance radius (the item's own, else NAV_ACC_RAD) and within NAV_MC_ALT_RAD of the
height; with a yaw, also within MIS_YAW_ERR of it, where the heading is known well enough; then hold times run. What
does not fly knows no height, a rover does not hold at waypoints, and takes the radius that its control works out for
a corner where that is larger. Who stands on the ground reaches no place. LOITER_TO_ALT is reached on the circle that
a fixed wing would fly. Landing is done when landed, takeoff when the height is reached. A gripper is waited for, but
not longer than MIS_COMMAND_TOUT, and so long a winch, which is not there. All other items are done at once. With
MIS_YAW_TMT, a yaw is waited for only where the item insists on it, and then the mission fails after that time.
"""

import math
from typing import NamedTuple

from sitl_emu.autopilot.commands.table import Role, items_where
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.topics import NavigatorMissionItem
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import EARTH_RADIUS_M, wrap_pi

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
DO_GRIPPER = mavlink.MAV_CMD_DO_GRIPPER
DO_WINCH = mavlink.MAV_CMD_DO_WINCH
TAKEOFFS = frozenset((TAKEOFF, VTOL_TAKEOFF))
LANDS = frozenset((LAND, VTOL_LAND))
WITH_POSITION = items_where(lambda item: item.role is Role.PLACE)
PLACED = items_where(lambda item: item.role in (Role.PLACE, Role.GATE))


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


def target_of(item: MissionItem, home_alt_m: float) -> Target:
    """The item with its altitude made absolute; `home_alt_m` is AMSL."""
    if item.command not in PLACED:
        return Target(item.command, hold_s=item.param1, autocontinue=bool(item.autocontinue))
    alt_m = item.z + home_alt_m if item.frame in RELATIVE_FRAMES else item.z
    yaw_deg = 0.0 if item.command == LOITER_TO_ALT else item.param4  # which has none: PX4 keeps zero
    yaw_rad = wrap_pi(math.radians(yaw_deg)) if math.isfinite(yaw_deg) else math.nan
    return Target(
        item.command,
        item.lat_deg,
        item.lon_deg,
        alt_m,
        yaw_rad,
        item.param2 if item.command == WAYPOINT and math.isfinite(item.param2) else 0.0,
        item.param1 if item.command in (WAYPOINT, LOITER_TIME) and math.isfinite(item.param1) else 0.0,
        bool(item.autocontinue),
        (item.command == LOITER_TIME and item.param2 > 0.0) or (item.command == LOITER_TO_ALT and item.param1 > 0.0),
    )


def tell_item(state: NavigatorState, seq: int, target: Target, item: MissionItem | None = None) -> None:
    """Tell the log what is flown now (navigator_mission_item): an item of the plan, or one made on board."""
    radius_m = target.acceptance_radius_m if item is not None else state.settings.nav_acc_rad_m
    state.topics.navigator_mission_item = NavigatorMissionItem(
        state.now_us,
        seq,
        target.command,
        target.lat_deg,
        target.lon_deg,
        target.alt_m if item is None else item.z,
        target.hold_s,
        radius_m,
        0.0 if item is not None else state.settings.nav_loiter_rad_m,
        target.yaw_rad,
        0 if item is None else item.frame,
        ONBOARD if item is None else OF_PLAN,
        force_heading=target.force_heading,
        altitude_is_relative=item is not None and item.frame in RELATIVE_FRAMES,
        autocontinue=target.autocontinue,
    )


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
        if command in (DO_GRIPPER, DO_WINCH):
            waited_s = (state.now_us - self._started_us) * 1e-6
            if command == DO_WINCH:
                return waited_s > state.settings.mis_command_tout_s
            return state.topics.gripper.accepted_us >= self._started_us or waited_s > state.settings.mis_command_tout_s
        if command not in PLACED:
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
        return (state.now_us - self._position_reached_us) * 1e-6 >= hold_s

    def _is_there(self, state: NavigatorState, target: Target) -> bool:
        position = state.position
        if not position.valid or state.landed:
            return False
        away_m = self._away_m(target, position.lat, position.lon)
        if not state.traits.flies:
            return away_m <= state.acceptance_radius_m()
        if target.command in TAKEOFFS:
            climb_m, tolerance_m = target.alt_m - state.home_alt_m(), state.settings.nav_mc_alt_rad_m
            if 0.0 < climb_m < tolerance_m:
                tolerance_m = climb_m / 2.0
            return position.alt > target.alt_m - tolerance_m
        radius_m = target.acceptance_radius_m if target.acceptance_radius_m > 0.0 else state.acceptance_radius_m()
        if target.command == LOITER_TO_ALT:
            radius_m = state.acceptance_radius_m() + state.settings.nav_loiter_rad_m
        return away_m <= radius_m and abs(target.alt_m - position.alt) <= state.settings.nav_mc_alt_rad_m

    def _away_m(self, target: Target, lat_deg: float, lon_deg: float) -> float:
        """Distance on a plane at the target: exact enough near it, and quick."""
        if target is not self._planned:
            self._planned = target
            self._m_per_deg_lon = M_PER_DEG * math.cos(math.radians(target.lat_deg))
        return math.hypot((lat_deg - target.lat_deg) * M_PER_DEG, (lon_deg - target.lon_deg) * self._m_per_deg_lon)

    def _yaw_is_there(self, state: NavigatorState, target: Target) -> bool:
        turns = state.traits.stops_at_waypoints and target.command not in TAKEOFFS
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
        if target.force_heading and waited_s >= settings.mis_yaw_tmt_s and not state.mission_failure:
            state.mission_failure = True
            text = "unable to reach heading within timeout\t"
            state.say(Severity.CRITICAL, text, "navigator_mission_failure_heading")
        return not target.force_heading
