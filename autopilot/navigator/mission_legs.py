"""From a mission's items to setpoints: what MISSION and returns along a mission have in common.

PX4's MissionBase and MissionBlock (src/modules/navigator, v1.18). A landing pattern begins at the first DO_LAND_START
or, without one, at the landing (MavlinkMissionManager, which notes both as the items come).
"""

import math
from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

from sitl_emu.autopilot.constants import SetpointType, Severity
from sitl_emu.autopilot.navigator.mission_block import (
    LANDS,
    LOITER_TIME,
    LOITER_TO_ALT,
    LOITER_UNLIM,
    NAV_CMD_IDLE,
    ONBOARD,
    TAKEOFFS,
    WAYPOINT,
    Target,
    loiter_radius_m,
    target_of,
    tell_item,
)
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.topics import PositionSetpoint, PositionSetpointTriplet
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import distance_m

DO_LAND_START = mavlink.MAV_CMD_DO_LAND_START
HOLDING = frozenset((LOITER_TIME, LOITER_UNLIM, LOITER_TO_ALT))


class Work(Enum):
    """What is being done about the current item."""

    DEFAULT = "default"
    CLIMB = "climb"
    MOVE_TO_LAND = "move to land"
    PRECISION_LAND = "precision land"


class Landing(NamedTuple):
    """Items of a mission's landing pattern."""

    start: int
    land: int


def landing_of(items: Sequence[MissionItem]) -> Landing | None:
    """A mission's landing pattern; None where it does not land."""
    start = None
    for seq, item in enumerate(items):
        if start is None and item.command == DO_LAND_START:
            start = seq
        if item.command in LANDS:
            return Landing(seq if start is None else start, seq)
    return None


def setpoint_of(state: NavigatorState, target: Target) -> PositionSetpoint:
    """A target as the setpoint of this moment; LOITER_TO_ALT begins at the present height."""
    if target.command in LANDS:
        kind = SetpointType.LAND
    elif target.command in TAKEOFFS:
        kind = state.takeoff_type
    elif target.command in HOLDING:
        kind = SetpointType.LOITER
    else:
        kind = SetpointType.POSITION
    radius = target.acceptance_radius_m if target.acceptance_radius_m > 0.0 else math.nan
    alt_m = state.position.alt if target.command == LOITER_TO_ALT else target.alt_m
    setpoint = state.setpoint(kind, target.lat_deg, target.lon_deg, alt_m, target.yaw_rad, radius)
    return setpoint._replace(
        loiter_radius=loiter_radius_m(state, target), loiter_direction_counter_clockwise=target.loiter_radius_m < 0.0
    )


def fly_leg(
    state: NavigatorState,
    current: PositionSetpoint,
    following: PositionSetpoint,
    before: Work = Work.DEFAULT,
    flown: PositionSetpoint | None = None,
) -> None:
    """Fly on from the setpoint before (`flown`, else the triplet's), if there was one.

    One that stays the same keeps its leg, and so does a landing that `before` has led to.
    """
    start = state.triplet.current if flown is None else flown
    stays = before is Work.MOVE_TO_LAND or is_same(current, start)
    state.fly(current, previous=state.triplet.previous if stays else start, following=following)


def is_same(one: PositionSetpoint, other: PositionSetpoint) -> bool:
    """Whether they are so but for their times (MissionBase::position_setpoint_equal)."""
    yaw = one.yaw if math.isfinite(one.yaw) or math.isfinite(other.yaw) else other.yaw
    one = one._replace(timestamp=other.timestamp, yaw=yaw, alt_acceptance_radius=other.alt_acceptance_radius)
    return one == other


def follow_home(state: NavigatorState, target: Target) -> Target:
    """Home has another height: the triplet moves along with its item (updateMissionAltAfterHomeChanged)."""
    if not math.isfinite(target.alt_m):
        return target
    if math.isfinite(target.above_home_m):
        target = target._replace(alt_m=target.above_home_m + state.home_alt_m())
    previous, current, following = state.triplet[1:]
    up_m = target.alt_m - current.alt
    state.triplet = PositionSetpointTriplet(
        state.now_us,
        previous._replace(alt=previous.alt + up_m) if previous.valid else previous,
        current._replace(alt=current.alt + up_m),
        following._replace(alt=following.alt + up_m) if following.valid else following,
    )
    return target


def is_above(state: NavigatorState, lat_deg: float, lon_deg: float) -> bool:
    """Whether the vehicle may come down at a place as it is: above it, or on the ground."""
    position = state.position
    away_m = distance_m(lat_deg, lon_deg, position.lat, position.lon)
    return state.landed or away_m <= state.acceptance_radius_m()


def move_to_land(state: NavigatorState, item: MissionItem) -> Target:
    """Fly above an item's landing at the present height, before coming down; what is flown to."""
    state.centre_gimbal()
    land = target_of(item, state.home_alt_m())
    current = state.triplet.current
    alt_m = current.alt if current.valid and current.type == SetpointType.POSITION else state.position.alt
    radius_m = state.acceptance_radius_m()
    above = Target(WAYPOINT, land.lat_deg, land.lon_deg, alt_m, acceptance_radius_m=radius_m)
    tell_item(state, state.dataman.current_seq, above, item, as_planned=False)
    fly_leg(state, setpoint_of(state, above), setpoint_of(state, land))
    return above


def announce(state: NavigatorState, *, ready: bool, executing: bool) -> bool:
    """Tell that a mission is flown, once, or that none is there; whether one is."""
    if ready:
        if not executing:
            state.say(Severity.INFO, "Executing Mission\t", "mission_execute")
    elif state.landed:
        text = "No valid mission available, refusing takeoff\t"
        state.say(Severity.CRITICAL, text, "mission_not_valid_refuse")
    else:
        state.say(Severity.CRITICAL, "No valid mission available, loitering\t", "mission_not_valid_loiter")
    return ready


def tell_finished(state: NavigatorState) -> None:
    """Say that no item is left."""
    if state.landed:
        state.say(Severity.INFO, "Mission finished, landed\t", "mission_finished")
    else:
        state.say(Severity.INFO, "Mission finished, loitering\t", "mission_finished_loiter")


def stay(state: NavigatorState) -> None:
    """There is nothing to fly (any more): hold in the air, with no way to brake; on the ground nothing changes.

    MissionBase::setEndOfMissionItems.
    """
    state.finished = state.mission_finished = True
    state.tell_mission()
    current, position = state.triplet.current, state.position
    if state.landed:
        state.fly(current)
    elif current.valid and current.type in (SetpointType.LOITER, SetpointType.POSITION):
        state.fly(hold_at(state, current))
    else:
        radius_m = state.acceptance_radius_m()
        here = position.lat, position.lon, state.loiter_alt_m()
        state.fly(state.setpoint(SetpointType.LOITER, *here, acceptance_radius_m=radius_m))
    _tell_end(state)


def _tell_end(state: NavigatorState) -> None:
    """Tell the log: on the ground the last item idles, in the air it becomes the place to hold at."""
    last, hold = state.topics.navigator_mission_item, state.triplet.current
    told = last._replace(timestamp=state.now_us, nav_cmd=NAV_CMD_IDLE, time_inside=0.0)
    if not state.landed:
        told = told._replace(
            nav_cmd=LOITER_UNLIM,
            latitude=hold.lat,
            longitude=hold.lon,
            altitude=hold.alt,
            acceptance_radius=hold.acceptance_radius,
            loiter_radius=-hold.loiter_radius if hold.loiter_direction_counter_clockwise else hold.loiter_radius,
            yaw=hold.yaw,
            origin=ONBOARD,
            altitude_is_relative=False,
            autocontinue=False,
        )
    state.topics.navigator_mission_item = told


def stop_below_ceiling(state: NavigatorState) -> bool:
    """Hold here instead of going higher above the ground than sensors in use can measure; whether that was needed.

    MissionBlock::updateMaxHaglFailsafe.
    """
    local, position = state.topics.vehicle_local_position, state.position
    ceiling_m = min(local.hagl_max_z, local.hagl_max_xy)
    if not position.terrain_alt_valid or not state.triplet.current.alt - position.terrain_alt > ceiling_m:
        return False
    state.say(Severity.INFO, "Target altitude higher than max HAGL\t", "navigator_fail_max_hagl")
    here, radius_m = (position.lat, position.lon, state.loiter_alt_m()), state.acceptance_radius_m()
    hold = state.setpoint(SetpointType.LOITER, *here, acceptance_radius_m=radius_m)
    state.triplet = state.triplet._replace(timestamp=state.now_us, current=hold)
    return True


def hold_at(state: NavigatorState, setpoint: PositionSetpoint) -> PositionSetpoint:
    """Hold where a setpoint is (MissionBlock::setLoiterItemFromCurrentPositionSetpoint)."""
    there = setpoint.lat, setpoint.lon, setpoint.alt, setpoint.yaw
    hold = state.setpoint(SetpointType.LOITER, *there, acceptance_radius_m=state.acceptance_radius_m())
    return hold._replace(
        loiter_radius=setpoint.loiter_radius,
        loiter_direction_counter_clockwise=setpoint.loiter_direction_counter_clockwise,
    )
