"""MISSION: one item after the other. PX4's Mission and MissionBase (src/modules/navigator/mission*.cpp, v1.18).

Items that need no flying, and places where the vehicle is already, are done at once behind the one before them: the
navigator wakes itself when it moves on (navigator.py), so of these only the last is announced as reached. A mission
that begins or goes on below its next place climbs straight up first; a landing that is not below flies to its place at
the present height first. At the end, landed: idle, in MISSION; in the air: hold, and the commander changes to HOLD. A
mission that has ended begins again after a landing, or where the ground says; else there is none.

Left out: mission landing patterns of fixed wings and VTOL, winch items (carried out without effect), terrain heights.
"""

import math

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.navigator.geofence import Geofence
from sitl_emu.autopilot.navigator.mission_base import MissionBase
from sitl_emu.autopilot.navigator.mission_block import (
    DELAY,
    GATE,
    LANDS,
    LOITER_TIME,
    LOITER_TO_ALT,
    LOITER_UNLIM,
    TAKEOFF,
    TAKEOFFS,
    WAYPOINT,
    WITH_POSITION,
    Target,
    loiter_radius_m,
    target_of,
    tell_command,
    tell_item,
)
from sitl_emu.autopilot.navigator.mission_commands import DO_CHANGE_SPEED, change_speed, raw_command_of
from sitl_emu.autopilot.navigator.mission_feasibility import is_feasible
from sitl_emu.autopilot.navigator.mission_jumps import Jumps
from sitl_emu.autopilot.navigator.mission_legs import (
    Work,
    announce,
    fly_leg,
    is_above,
    landing_of,
    move_to_land,
    setpoint_of,
    stay,
    tell_finished,
)
from sitl_emu.autopilot.navigator.payload import Payload
from sitl_emu.autopilot.navigator.roi import Roi
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem, Plan
from sitl_emu.autopilot.topics import PositionSetpoint
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import distance_m

STATE_NO_MISSION: int = mavlink.MISSION_STATE_NO_MISSION
STATE_NOT_STARTED: int = mavlink.MISSION_STATE_NOT_STARTED
STATE_ACTIVE: int = mavlink.MISSION_STATE_ACTIVE
STATE_PAUSED: int = mavlink.MISSION_STATE_PAUSED
STATE_COMPLETE: int = mavlink.MISSION_STATE_COMPLETE


class Mission(MissionBase):
    """AUTO_MISSION, and the progress of the mission in every mode."""

    def __init__(self, state: NavigatorState, roi: Roi, payload: Payload, geofence: Geofence) -> None:
        super().__init__(state, roi, payload)
        self._geofence = geofence
        self._plan: Plan | None = None
        self._fence: Plan | None = None
        self._checked = False
        self.jumps = Jumps(state)
        self._ahead: list[int] = []
        """The next two places behind the current item."""
        self._climb_alt_m = math.nan
        self._has_next_item = False
        self._was_activated = False
        self._was_disarmed = False
        self._mission_state = 0
        self.valid = False
        self.seq_reached_us = 0

    # --- from outside ---------------------------------------------------------------------------------------

    def take_plan(self) -> None:
        """Notice a new plan or fence, and check the mission as soon as home is known. In flight, it goes on at once."""
        dataman = self._state.dataman
        is_new = dataman.mission is not self._plan
        if is_new:
            self._plan = dataman.mission
            self.jumps.forget()
            self._resume.forget()
            self._was_activated = self._active
        elif not self._active:
            self._resume.note(dataman.current_seq)
        if dataman.fence is not self._fence or is_new:
            self._fence = dataman.fence
            self._checked = False
        checks = not self._checked and self._state.topics.home_position.valid and self._state.position.valid
        if checks:
            self._check()
        if (is_new or checks) and self._active:
            self._start(keeps_leg=not is_new)
        if is_new or checks:
            self._has_next_item = self._is_valid()

    @property
    def is_landing(self) -> bool:
        """Past the first place of its landing pattern: a return goes on with the mission then (isLanding)."""
        return self.lands_with(self._target)

    def lands_with(self, target: Target | None) -> bool:
        """The same for whoever flies the mission, to `target` now."""
        landing, seq = landing_of(self.items), self._state.dataman.current_seq
        if landing is None or not self.valid or not landing.start < seq <= landing.land:
            return False
        first = self.next_place(landing.start + 1)
        if first is None or seq > first:
            return first is not None
        position = self._state.position
        if seq < first or target is None or target.command != LOITER_TO_ALT:
            return False
        away_m = distance_m(target.lat_deg, target.lon_deg, position.lat, position.lon)
        return away_m <= self._state.acceptance_radius_m() + loiter_radius_m(self._state, target)

    def set_current(self, seq: int) -> bool:
        """MISSION_SET_CURRENT; False for an item that is not there. The current one again changes nothing."""
        if not 0 <= seq < len(self.items):
            return False
        if seq != self._state.dataman.current_seq:
            self._state.dataman.current_seq = seq
            if self._active:
                self._start()
            self._resume.forget()
        self._has_next_item = self._is_valid()
        return True

    def start_at(self, seq: int) -> None:
        """MISSION_START: where the mission begins, if it can be flown and is elsewhere."""
        if seq == self._state.dataman.current_seq or not self.valid:
            return
        place = self.jumps.behind(seq, follow=True)
        if place is None:
            return
        self._state.dataman.current_seq = place
        self._has_next_item = True
        if self._active:
            self._start()
        self._resume.forget()

    def _check(self) -> None:
        """Work out whether the mission can be flown, and forget what was reached of it."""
        self._checked = True
        self.valid = is_feasible(self._state, self._geofence, self.items)
        self._state.seq_reached = -1
        self._state.mission_failure = False
        self.tell_progress()

    def _is_valid(self) -> bool:
        return self.valid and self._state.dataman.current_seq < len(self.items)

    def begin_report(self) -> None:
        """A mission begins or goes on: what was reached, and what was looked at, is forgotten (update_mission)."""
        self._roi.forget()
        if self.valid:
            self._state.seq_reached = -1
            self._state.mission_failure = False
        self.tell_progress()

    def tell_progress(self) -> None:
        """The current item is told, whoever flies it."""
        self._state.mission_finished = False
        self._state.mission_seq = self._state.dataman.current_seq
        self._state.tell_mission()

    def tell_reached(self) -> None:
        """The current item has been reached, whoever flies it."""
        self._state.seq_reached = self._state.dataman.current_seq
        self.seq_reached_us = self._state.now_us
        self._state.tell_mission()

    # --- as a mode ------------------------------------------------------------------------------------------

    def on_inactive(self) -> None:
        """Another mode is flown, or the vehicle is not armed."""
        if self._active:
            self._leave()
        self._executing = False
        self._work = Work.DEFAULT
        self._was_disarmed = self._was_disarmed or not self._state.armed

    def on_activation(self) -> None:
        """Enter MISSION: at its first item again if it was flown to the end before the last landing."""
        state = self._state
        self._active = True
        self._check()
        if self._was_disarmed and self._was_activated and state.dataman.current_seq + 1 == len(self.items):
            state.dataman.current_seq = 0
            self.jumps.forget()
            self._has_next_item = self._is_valid()
            self._resume.forget()
        self._was_activated, self._was_disarmed = True, False
        self._go_back()
        self._require_climb()
        self._start()
        state.cruising_speed_m_s = -1.0
        if not self._speed_waits:
            self._replay_speed()
        if self._target is not None and self._target.command == DO_CHANGE_SPEED:
            # The first item's command; PX4's navigator obeys it in its next cycle, so after this reset.
            change_speed(state, raw_command_of(self.items[state.dataman.current_seq]))

    def _start(self, *, keeps_leg: bool = False) -> None:
        """The mission begins or goes on at its current item; on the leg that is flown if only the fence is new."""
        state = self._state
        if not keeps_leg:
            state.reset_triplet()
        state.finished = False
        ready = self._has_next_item and self._is_valid()
        self._executing = announce(state, ready=ready, executing=self._executing)
        if self.valid and (state.landed or self._work is Work.CLIMB):
            self._require_climb()
        self._work = Work.DEFAULT if self.valid else self._work
        self.begin_report()
        self._set_item()

    def _require_climb(self) -> None:
        """Before it begins, a mission climbs to the height of its next place, if that is above the vehicle."""
        state = self._state
        self._climb_alt_m = math.nan
        place = self.next_place(state.dataman.current_seq)
        if place is None or not state.traits.flies:
            return
        alt_m = target_of(self.items[place], state.home_alt_m()).alt_m
        if alt_m - state.position.alt > state.altitude_acceptance_m():
            self._climb_alt_m = alt_m

    def _item_done(self) -> None:
        assert self._target is not None
        if self._work is not Work.CLIMB:
            self.tell_reached()
        if self._target.autocontinue:
            if self._work is Work.DEFAULT:
                self._advance()
            self._set_item()
        else:
            self._target = self._target._replace(command=LOITER_UNLIM)

    def _advance(self) -> None:
        state = self._state
        seq = self.jumps.behind(state.dataman.current_seq + 1, follow=True)
        if seq is not None:
            state.dataman.current_seq = seq
            return
        self._has_next_item = False
        tell_finished(state)
        if state.dataman.current_seq + 1 == len(self.items):
            self.jumps.forget()

    # --- items ----------------------------------------------------------------------------------------------

    def _set_item(self) -> None:
        """Begin with the current item, or with that behind it if it is a jump."""
        dataman, work = self._state.dataman, self._work
        self._work = Work.DEFAULT
        ready = self._has_next_item and self._executing and self._is_valid()
        seq = self.jumps.behind(dataman.current_seq) if ready else None
        if seq is None:
            if ready:
                text = "Mission item could not be set.\t"
                self._state.say(Severity.CRITICAL, text, "mission_item_set_failed")
            self._end()
            return
        dataman.current_seq = seq
        self.tell_progress()
        self._ahead = self.jumps.places(seq + 1, 2)
        item = self.items[seq]
        if item.command == GATE:
            self._pass_gate(item)
        elif item.command not in WITH_POSITION:
            self._carry_out(item)
        elif work is Work.DEFAULT and math.isfinite(self._climb_alt_m):
            self._climb(item)
        elif work is Work.DEFAULT and self._lands_elsewhere(item):
            self._begin(move_to_land(self._state, item), Work.MOVE_TO_LAND)
        else:
            self._fly_to_item(item, work)

    def _lands_elsewhere(self, item: MissionItem) -> bool:
        state = self._state
        return item.command in LANDS and state.traits.flies and not is_above(state, item.lat_deg, item.lon_deg)

    def next_place(self, seq: int) -> int | None:
        """The first item with a position from `seq` on, behind jumps and what is carried out on the way."""
        return next(iter(self.jumps.places(seq, 1)), None)

    def _carry_out(self, item: MissionItem) -> None:
        state = self._state
        self._begin(target_of(item, state.home_alt_m()), Work.DEFAULT)
        tell_command(state, state.dataman.current_seq, item)
        triplet = state.triplet
        stops = item.command == DELAY  # so that the vehicle holds where it is rather than heading on
        following = state.no_setpoint() if stops else triplet.next
        state.fly(triplet.current, previous=triplet.previous, following=following)
        self._commands.issue(item)

    def _pass_gate(self, item: MissionItem) -> None:
        """Fly to the place behind a gate, and through it on the way."""
        state = self._state
        self._begin(target_of(item, state.home_alt_m()), Work.DEFAULT)
        tell_command(state, state.dataman.current_seq, item)
        places = [self._setpoint_at(place) for place in self._ahead]
        current, following = (*places, state.triplet.current, state.no_setpoint())[:2]
        fly_leg(state, current, following)

    def _climb(self, item: MissionItem) -> None:
        """Straight up to the height of the first place; from the ground, this is the takeoff."""
        state, alt_m = self._state, self._climb_alt_m
        position, above_home_m = state.position, alt_m - state.home_alt_m()
        self._climb_alt_m = math.nan
        text = f"Climb to {above_home_m:.1f} meters above home\t"
        state.say(Severity.INFO, text, "mission_climb_before_start", above_home_m)
        then = target_of(item, state.home_alt_m())._replace(command=WAYPOINT)
        target = then._replace(
            command=TAKEOFF if state.landed else LOITER_TO_ALT,
            lat_deg=position.lat,
            lon_deg=position.lon,
            alt_m=alt_m,
            yaw_rad=math.nan,
            hold_s=0.0,
            autocontinue=True,
            above_home_m=math.nan,
        )
        self._begin(target, Work.CLIMB)
        tell_item(state, state.dataman.current_seq, target, item, as_planned=False)
        fly_leg(state, setpoint_of(state, target), setpoint_of(state, then))

    def _fly_to_item(self, item: MissionItem, before: Work) -> None:
        state = self._state
        target = target_of(item, state.home_alt_m())
        if item.command in TAKEOFFS and state.traits.flies:
            target = target._replace(command=WAYPOINT, yaw_rad=math.nan)
        elif item.command in LANDS:
            target = target._replace(yaw_rad=math.nan)
        self._begin(target, Work.DEFAULT)
        tell_item(state, state.dataman.current_seq, target, item)
        setpoint, following, flown = setpoint_of(state, target), self._following(), state.triplet.current
        if self._precland.begins_at(item):
            self._work = Work.PRECISION_LAND
            setpoint = state.triplet.current
        fly_leg(state, setpoint, following, before, flown)

    def _following(self) -> PositionSetpoint:
        """The next place, to cut the corner; none where the vehicle stays for a while."""
        state = self._state
        current = self.items[state.dataman.current_seq]
        holds = state.traits.stops_at_waypoints and current.command in (WAYPOINT, LOITER_TIME) and current.param1 > 0.0
        if holds or not current.autocontinue or not self._ahead:
            return state.no_setpoint()
        return self._setpoint_at(self._ahead[0])

    def _setpoint_at(self, seq: int) -> PositionSetpoint:
        return setpoint_of(self._state, target_of(self.items[seq], self._state.home_alt_m()))

    def _end(self) -> None:
        self._executing = False
        self._target = None
        stay(self._state)

    # --- what MISSION_CURRENT says --------------------------------------------------------------------------

    def mission_state(self) -> int:
        """MISSION_STATE; it stays as it was where PX4 knows no better."""
        if not self.items or not self.valid:
            self._mission_state = STATE_NO_MISSION
        elif self._state.mission_finished:
            self._mission_state = STATE_COMPLETE
        elif FLIGHT_MODES[self._state.topics.vehicle_status.nav_state].mission_is_active:
            self._mission_state = STATE_ACTIVE
        elif self._state.told_reached >= 0:
            self._mission_state = STATE_PAUSED
        elif self._state.mission_seq < 1:
            self._mission_state = STATE_NOT_STARTED
        return self._mission_state
