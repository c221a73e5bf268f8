"""MISSION: one item after the other. PX4's Mission and MissionBase (src/modules/navigator/mission*.cpp, v1.18).

Items that need no flying are carried out at once behind the place before them, and of these only the last is announced
as reached; of places, one is reached in a cycle. A takeoff on the ground climbs straight up first and then flies to its
place; a landing that is not below flies to its place at the present height first. At the end, landed: idle, in MISSION;
in the air: hold, and the commander changes to HOLD.

Left out: mission landing patterns of fixed wings and VTOL, gripper, winch and actuator items (carried out without
effect), terrain heights.
"""

import math
from enum import Enum

from autopilot.constants import NavState, SetpointType, Severity
from autopilot.dataman import MissionItem, Plan
from autopilot.navigator import mission_feasibility
from autopilot.navigator.mission_block import (
    LAND,
    LANDS,
    LOITER_TIME,
    LOITER_TO_ALT,
    LOITER_UNLIM,
    PLACED,
    RETURN_TO_LAUNCH,
    TAKEOFFS,
    WAYPOINT,
    Reached,
    Target,
    target_of,
)
from autopilot.navigator.payload import PAYLOAD_COMMANDS, Payload
from autopilot.navigator.precland import Precision, PrecLand
from autopilot.navigator.roi import ROI_COMMANDS, Roi
from autopilot.navigator.rover_acceptance import acceptance_radius_m
from autopilot.navigator.state import NavigatorState
from autopilot.topics import PositionSetpoint, VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import distance_m

DO_JUMP = mavlink.MAV_CMD_DO_JUMP
DO_CHANGE_SPEED = mavlink.MAV_CMD_DO_CHANGE_SPEED
DO_SET_HOME = mavlink.MAV_CMD_DO_SET_HOME
FRAME_MISSION: int = mavlink.MAV_FRAME_MISSION
STATE_NO_MISSION: int = mavlink.MISSION_STATE_NO_MISSION
STATE_NOT_STARTED: int = mavlink.MISSION_STATE_NOT_STARTED
STATE_ACTIVE: int = mavlink.MISSION_STATE_ACTIVE
STATE_PAUSED: int = mavlink.MISSION_STATE_PAUSED
STATE_COMPLETE: int = mavlink.MISSION_STATE_COMPLETE
MISSION_MODES = frozenset((NavState.AUTO_MISSION, NavState.AUTO_TAKEOFF, NavState.AUTO_LAND))
"""In these PX4 calls a mission active (mavlink_mission.cpp, update_mission_state), armed or not."""
HOLDING = frozenset((LOITER_TIME, LOITER_UNLIM, LOITER_TO_ALT))


class Work(Enum):
    """What is being done about the current item."""

    DEFAULT = "default"
    TAKEOFF = "takeoff"
    MOVE_TO_LAND = "move to land"


class Mission:
    """AUTO_MISSION, and the progress of the mission in every mode."""

    def __init__(self, state: NavigatorState, roi: Roi, payload: Payload) -> None:
        self._state = state
        self._roi = roi
        self._payload = payload
        self._precland = PrecLand(state)
        self._lands_precisely = False
        self._plan: Plan | None = None
        self._jumps: dict[int, int] = {}
        self._work = Work.DEFAULT
        self._target: Target | None = None
        self._rover_radius_m = math.nan
        self._reached = Reached()
        self._running = False
        self.valid = False
        self.ended = False
        self.seq_reached = -1
        self.seq_reached_us = 0
        self.jumped = -1
        """The DO_JUMP item that was followed last, until it is told; else -1."""

    @property
    def seq_current(self) -> int:
        """The item that is flown, or would be next."""
        return self._state.dataman.current_seq

    @property
    def items(self) -> tuple[MissionItem, ...]:
        """The mission as uploaded."""
        return self._state.dataman.mission.items

    # --- from outside ---------------------------------------------------------------------------------------

    def take_plan(self) -> bool:
        """Notice a new plan; True when there is one. In flight, it goes on at once at the current item."""
        plan = self._state.dataman.mission
        if plan is self._plan:
            return False
        self._plan = plan
        self._jumps.clear()
        self.ended = False
        self.seq_reached = -1
        self.check()
        if self._running:
            self._start()
        return True

    def check(self) -> None:
        """Work out whether the mission can be flown."""
        trouble = mission_feasibility.problem(self._state, self.items)
        if trouble:
            self._state.say(Severity.CRITICAL, trouble, mission_feasibility.EVENTS.get(trouble, ""))
        self.valid = trouble is None

    def set_current(self, seq: int) -> bool:
        """MISSION_SET_CURRENT; False for an item that is not there."""
        if not 0 <= seq < len(self.items):
            return False
        self._state.dataman.current_seq = seq
        self.ended = False
        self._jumps.clear()
        if self._running:
            self._state.cruising_speed_m_s = -1.0
            self._set_item()
        return True

    # --- as a mode ------------------------------------------------------------------------------------------

    def on_inactive(self) -> None:
        """Another mode is flown, or the vehicle is not armed."""
        self._running = False
        self._payload.stop()

    def on_activation(self) -> None:
        """Enter MISSION."""
        self._running = False

    def on_active(self) -> None:
        """Every cycle in MISSION."""
        state = self._state
        if not self._running:
            if not self.valid:
                return
            self._start()
        for _ in range(len(self.items) + 1):
            if self.ended or self._target is None:
                return
            if self._lands_precisely:
                self._precland.on_active()
            if not self._reached.update(state, self._target, self._rover_radius_m):
                return
            self._item_done()
            if self._target is not None and self._target.command in PLACED:
                return

    def _start(self) -> None:
        state = self._state
        self._running = True
        if not self.valid:
            self._end()
            return
        if self.ended:
            state.dataman.current_seq = 0
            self._jumps.clear()
        self.ended = False
        state.finished = False
        state.say(Severity.INFO, "Executing Mission\t", "mission_execute")
        self._replay_speed()
        self._set_item()

    def _replay_speed(self) -> None:
        """A mission that goes on has the speed that its last item before this one gave."""
        speeds = [item.param2 for item in self.items[: self.seq_current] if item.command == DO_CHANGE_SPEED]
        change_speed(self._state, speeds[-1] if speeds else -1.0)

    def _item_done(self) -> None:
        if self._work is Work.TAKEOFF:
            self._fly_to_item(self.items[self.seq_current], Work.DEFAULT)
            return
        self.seq_reached = self.seq_current
        self.seq_reached_us = self._state.now_us
        if self._work is Work.MOVE_TO_LAND:
            self._fly_to_item(self.items[self.seq_current], Work.DEFAULT)
            return
        assert self._target is not None
        if self._target.autocontinue:
            self._state.dataman.current_seq += 1
            self._set_item()
        else:
            self._target = Target(LOITER_UNLIM)

    # --- items ----------------------------------------------------------------------------------------------

    def _set_item(self) -> None:
        """Begin with the current item, following jumps."""
        state = self._state
        seq = self._after_jumps(state.dataman.current_seq)
        if seq >= len(self.items):
            state.dataman.current_seq = max(len(self.items) - 1, 0)
            self._end()
            return
        state.dataman.current_seq = seq
        item = self.items[seq]
        if item.command not in PLACED:
            self._carry_out(item)
            return
        if item.command in TAKEOFFS and state.landed and not state.rover:
            self._take_off(item)
        elif item.command in LANDS and not state.rover and not self._is_above(item):
            self._move_to_land(item)
        else:
            self._fly_to_item(item, Work.DEFAULT)

    def _after_jumps(self, seq: int) -> int:
        items = self.items
        for _ in range(2 * len(items) + 1):
            if seq >= len(items) or items[seq].command != DO_JUMP:
                return seq
            jump = items[seq]
            repeat, done = int(jump.param2), self._jumps.get(seq, 0)
            if repeat < 0 or done < repeat:
                self._jumps[seq] = done + 1
                self.jumped = seq
                seq = int(jump.param1)
            else:
                self._jumps[seq] = 0
                seq += 1
        return len(items)

    def _carry_out(self, item: MissionItem) -> None:
        state = self._state
        self._work = Work.DEFAULT
        self._target = Target(item.command, hold_s=item.param1, autocontinue=True)
        self._reached.restart(state.now_us)
        if item.command == DO_CHANGE_SPEED:
            change_speed(state, item.param2)
        elif item.command in ROI_COMMANDS:
            self._roi.take(_command_of(item, state.home_alt_m()))
        elif item.command in (RETURN_TO_LAUNCH, DO_SET_HOME):
            state.command(_command_of(item, state.home_alt_m()))
        elif item.command in PAYLOAD_COMMANDS:
            self._payload.issue(_payload_command_of(item))

    def _take_off(self, item: MissionItem) -> None:
        state = self._state
        position = state.position
        target = target_of(item, state.home_alt_m())
        alt_m = max(target.alt_m, position.alt + state.settings.nav_mc_alt_rad_m)
        above_home_m = alt_m - state.home_alt_m()
        text = f"Climb to {above_home_m:.1f} meters above home\t"
        state.say(Severity.INFO, text, "mission_climb_before_start", above_home_m)
        self._begin(target._replace(lat_deg=position.lat, lon_deg=position.lon, alt_m=alt_m), Work.TAKEOFF)
        current = state.setpoint(SetpointType.TAKEOFF, position.lat, position.lon, alt_m, target.yaw_rad)
        state.fly(current, previous=state.here())

    def _is_above(self, item: MissionItem) -> bool:
        position = self._state.position
        away_m = distance_m(item.lat_deg, item.lon_deg, position.lat, position.lon)
        return self._state.landed or away_m <= self._state.settings.nav_acc_rad_m

    def _move_to_land(self, item: MissionItem) -> None:
        state = self._state
        target = target_of(item, state.home_alt_m())
        current = state.triplet.current
        alt_m = current.alt if current.valid and math.isfinite(current.alt) else state.position.alt
        self._begin(Target(WAYPOINT, target.lat_deg, target.lon_deg, alt_m), Work.MOVE_TO_LAND)
        setpoint = state.setpoint(SetpointType.POSITION, target.lat_deg, target.lon_deg, alt_m)
        state.fly(setpoint, previous=self._previous(), following=self._setpoint_of(target))

    def _fly_to_item(self, item: MissionItem, work: Work) -> None:
        state = self._state
        target = target_of(item, state.home_alt_m())
        if item.command in TAKEOFFS and not state.rover:
            target = target._replace(command=WAYPOINT, hold_s=0.0)
        self._begin(target, work)
        if item.command == LAND and item.param2 in (Precision.OPPORTUNISTIC, Precision.REQUIRED) and not state.rover:
            self._lands_precisely = True
            self._precland.begin(target.lat_deg, target.lon_deg, state.position.alt, Precision(int(item.param2)))
            return
        current = self._setpoint_of(target)
        following = self._following()
        previous = self._previous()
        if state.rover:
            self._rover_radius_m = acceptance_radius_m(
                state.settings,
                (previous.lat, previous.lon) if previous.valid else None,
                (current.lat, current.lon),
                (following.lat, following.lon) if following.valid else None,
            )
            current = current._replace(acceptance_radius=self._rover_radius_m)
        state.fly(current, previous=previous, following=following)
        state.can_loiter_at_setpoint = False

    def _begin(self, target: Target, work: Work) -> None:
        self._target = target
        self._work = work
        self._lands_precisely = False
        self._reached.restart(self._state.now_us)

    def _setpoint_of(self, target: Target) -> PositionSetpoint:
        if target.command in LANDS:
            kind = SetpointType.LAND
        elif target.command in TAKEOFFS:
            kind = SetpointType.TAKEOFF
        elif target.command in HOLDING:
            kind = SetpointType.LOITER
        else:
            kind = SetpointType.POSITION
        radius = target.acceptance_radius_m if target.acceptance_radius_m > 0.0 else math.nan
        return self._state.setpoint(kind, target.lat_deg, target.lon_deg, target.alt_m, target.yaw_rad, radius)

    def _previous(self) -> PositionSetpoint:
        current = self._state.triplet.current
        if current.valid and math.isfinite(current.lat):
            return current
        return self._state.here()

    def _following(self) -> PositionSetpoint:
        """The next place, behind jumps and what is carried out on the way, to cut the corner; none after a hold."""
        items, current = self.items, self.items[self.seq_current]
        if current.command in HOLDING or current.command in LANDS or (not self._state.rover and current.param1 > 0.0):
            return PositionSetpoint()
        seq = self.seq_current + 1
        for _ in range(2 * len(items)):
            if seq >= len(items):
                break
            item = items[seq]
            if item.command in PLACED:
                return self._setpoint_of(target_of(item, self._state.home_alt_m()))
            jumps = item.command == DO_JUMP and (item.param2 < 0 or self._jumps.get(seq, 0) < item.param2)
            seq = int(item.param1) if jumps else seq + 1
        return PositionSetpoint()

    def _end(self) -> None:
        state = self._state
        self.ended = True
        self._target = None
        state.finished = True
        state.cruising_speed_m_s = -1.0
        if state.landed:
            state.say(Severity.INFO, "Mission finished, landed\t", "mission_finished")
            state.idle()
            return
        state.say(Severity.INFO, "Mission finished, loitering\t", "mission_finished_loiter")
        current = state.triplet.current
        if current.valid and math.isfinite(current.lat):
            lat, lon, alt, yaw = current.lat, current.lon, current.alt, current.yaw
        else:
            lat, lon = state.stop_point()
            alt, yaw = state.position.alt, math.nan
        state.fly(state.setpoint(SetpointType.LOITER, lat, lon, alt, yaw))
        state.can_loiter_at_setpoint = True

    # --- what MISSION_CURRENT says --------------------------------------------------------------------------

    def mission_state(self) -> int:
        """MISSION_STATE."""
        status = self._state.topics.vehicle_status
        if not self.items or not self.valid:
            return STATE_NO_MISSION
        if self.ended:
            return STATE_COMPLETE
        if status.nav_state in MISSION_MODES:
            return STATE_ACTIVE
        return STATE_PAUSED if self.seq_reached >= 0 else STATE_NOT_STARTED


def change_speed(state: NavigatorState, speed_m_s: float) -> None:
    """DO_CHANGE_SPEED: a speed, or back to the vehicle's own for anything that is not above 0."""
    state.cruising_speed_m_s = speed_m_s if math.isfinite(speed_m_s) and speed_m_s > 0.0 else -1.0


def _command_of(item: MissionItem, home_alt_m: float) -> VehicleCommand:
    target_alt = item.z + home_alt_m if item.frame in (3, 6) else item.z
    return VehicleCommand(
        item.command,
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        item.lat_deg,
        item.lon_deg,
        target_alt,
        frame=mavlink.MAV_FRAME_GLOBAL,
        from_external=False,
    )


def _payload_command_of(item: MissionItem) -> VehicleCommand:
    """All seven parameters as they came, because an item in MAV_FRAME_MISSION has no place."""
    param5, param6 = (item.lat_deg, item.lon_deg) if item.frame != FRAME_MISSION else (float(item.x), float(item.y))
    return VehicleCommand(
        item.command, item.param1, item.param2, item.param3, item.param4, param5, param6, item.z, from_external=False
    )
