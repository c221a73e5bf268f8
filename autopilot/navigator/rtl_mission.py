"""Returns along the mission: to its landing, on to its end, or back to where it began.

PX4's RtlDirectMissionLand, RtlMissionFast and RtlMissionFastReverse (src/modules/navigator/rtl_*mission*.cpp, v1.18).
Places alone are flown to, as waypoints that are passed without a stop; what else the mission does is left out, jumps
too. They move the mission's current item, which a ground station may set as in MISSION. A return that comes back to the
take-off climbs to its height there, goes above home as high as it is then, and lands.

Whatever a mission does when it is left and goes on, they do too, each for itself (`mission_base.py`).
"""

import math
from enum import IntEnum

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.navigator.mission import Mission
from sitl_emu.autopilot.navigator.mission_base import MissionBase
from sitl_emu.autopilot.navigator.mission_block import (
    LAND,
    LANDS,
    LOITER_TIME,
    LOITER_TO_ALT,
    LOITER_UNLIM,
    TAKEOFFS,
    WAYPOINT,
    WITH_POSITION,
    Target,
    target_of,
    tell_command,
    tell_item,
)
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
from sitl_emu.autopilot.navigator.precland import Precision
from sitl_emu.autopilot.navigator.roi import Roi
from sitl_emu.autopilot.navigator.rtl_time import along_s, vertical_s
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem, Plan
from sitl_emu.autopilot.topics import PositionSetpoint
from sitl_emu.core.geodesy import distance_m


class RtlType(IntEnum):
    """rtl_status.rtl_type: how a return goes."""

    DIRECT = 1
    """Straight to home or a rally point (`rtl_direct.py`)."""
    DIRECT_MISSION_LAND = 2
    """Straight to the mission's landing pattern."""
    MISSION_FAST = 3
    """On along the mission to its landing."""
    MISSION_FAST_REVERSE = 4
    """Back along the mission, and home."""


class RtlMission(MissionBase):
    """AUTO_RTL along the mission."""

    def __init__(self, state: NavigatorState, mission: Mission, roi: Roi, payload: Payload) -> None:
        super().__init__(state, roi, payload)
        self._mission = mission
        self._kind = RtlType.MISSION_FAST
        self._return_alt_m = math.nan
        self._climbs = self._has_item = self._comes_down = False
        self._plan: Plan | None = None
        self._seq = -1
        """The current item as this return has set it."""

    def choose(self, kind: RtlType, return_alt_m: float) -> None:
        """How the next return goes; AMSL height to which it climbs before it makes for a landing pattern."""
        self._kind, self._return_alt_m = kind, return_alt_m
        self._home_count = 0
        self._resume.forget()

    def on_activation(self, flown_seq: int | None) -> None:
        """Begin. `flown_seq`: the item that MISSION was flying; None where another mode was flown."""
        self._note()
        state, self._active = self._state, True
        self._work, self._executing = Work.DEFAULT, False
        self._climbs = self._kind is RtlType.DIRECT_MISSION_LAND and self._is_to_climb
        first = self._first(flown_seq)
        if first is not None:
            state.dataman.current_seq = first
        self._has_item = first is not None and not state.landed
        self._go_back()
        self._take_up()
        self._set_item()
        state.cruising_speed_m_s = -1.0
        if not self._speed_waits:
            self._replay_speed()

    def on_inactive(self) -> None:
        """Every cycle of another mode, or of none."""
        if self._active:
            self._leave()
        else:
            self._note()

    def on_active(self) -> None:
        """Every cycle of the return."""
        state = self._state
        if state.dataman.mission is self._plan and state.dataman.current_seq == self._seq:
            super().on_active()
            return
        state.reset_triplet()
        seq = self._mission.jumps.behind(state.dataman.current_seq) if self._mission.valid else None
        self._has_item = seq is not None
        if seq is not None:
            state.dataman.current_seq = seq
        self._take_up()
        self._set_item()

    def _note(self) -> None:
        """Whoever has another mission, or another current item, begins anew (MissionBase::onMissionUpdate)."""
        dataman = self._state.dataman
        if dataman.mission is self._plan:
            self._resume.note(dataman.current_seq)
        else:
            self._resume.forget()

    @property
    def is_landing(self) -> bool:
        """On the landing pattern; back along the mission, from the place on where it began."""
        return (
            self._comes_down if self._kind is RtlType.MISSION_FAST_REVERSE else self._mission.lands_with(self._target)
        )

    def seconds_left(self, *, active: bool) -> float:
        """How long the landing pattern takes from here (RtlDirectMissionLand); NaN for the others: PX4 doesn't know."""
        state, landing = self._state, landing_of(self.items)
        if self._kind is not RtlType.DIRECT_MISSION_LAND or landing is None:
            return math.nan
        position = state.position
        legs_s: list[float] = []
        lat_deg, lon_deg, alt_m = position.lat, position.lon, position.alt
        climbs = self._work is Work.CLIMB if active else self._is_to_climb
        if climbs and (alt_m < self._return_alt_m or state.return_alt_enforced):
            legs_s.append(vertical_s(state, self._return_alt_m - alt_m))
            alt_m = self._return_alt_m
        seq = self._mission.next_place(max(state.dataman.current_seq, landing.start) if active else landing.start)
        while seq is not None:
            item = self.items[seq]
            place = target_of(item, state.home_alt_m())
            away_m = distance_m(lat_deg, lon_deg, place.lat_deg, place.lon_deg)
            if item.command == LOITER_UNLIM:
                # PX4 forgets what it has counted, and counts on.
                legs_s.clear()
            elif item.command == LOITER_TIME:
                legs_s.append(along_s(state, away_m) + max(place.hold_s, 0.0))
            elif item.command == LOITER_TO_ALT:
                legs_s.append(along_s(state, away_m) + vertical_s(state, place.alt_m - alt_m))
            else:
                legs_s.append(along_s(state, away_m, place.alt_m - alt_m))
            lat_deg, lon_deg, alt_m = place.lat_deg, place.lon_deg, place.alt_m
            seq = self._mission.next_place(seq + 1)
        return math.fsum(legs_s) if legs_s else math.nan

    @property
    def _is_to_climb(self) -> bool:
        """Whether it goes to its height before it makes for a landing pattern (checkNeedsToClimb)."""
        return self._state.position.alt < self._return_alt_m or self._state.return_alt_enforced

    # --- which item -------------------------------------------------------------------------------------------

    def _first(self, flown_seq: int | None) -> int | None:
        """The item that the return begins with; None where there is none."""
        landing = landing_of(self.items)
        if not self._mission.valid:
            return None
        if self._kind is RtlType.DIRECT_MISSION_LAND:
            return None if landing is None else landing.start
        if flown_seq is None:
            return self._closest()
        if self._kind is RtlType.MISSION_FAST:
            first = self._place_from(flown_seq)
            return landing.land if first is None and landing is not None else first
        before = self._place_before(flown_seq)
        return self._place_from(flown_seq + 1) if before is None else before

    def _closest(self) -> int | None:
        """The place that is nearest, its height counted too (setMissionToClosestItem)."""
        position, home_alt_m = self._state.position, self._state.home_alt_m()

        def away_m(seq: int) -> float:
            place = target_of(self.items[seq], home_alt_m)
            along_m = distance_m(place.lat_deg, place.lon_deg, position.lat, position.lon)
            return math.hypot(along_m, place.alt_m - position.alt)

        return min(self._places(), key=away_m, default=None)

    def _places(self) -> list[int]:
        """All items with a place: jumps are not followed."""
        return [seq for seq, item in enumerate(self.items) if item.command in WITH_POSITION]

    def _place_from(self, seq: int) -> int | None:
        return next((place for place in self._places() if place >= seq), None)

    def _place_before(self, seq: int) -> int | None:
        return next((place for place in reversed(self._places()) if place < seq), None)

    def next_place(self, seq: int) -> int | None:
        """The first item with a position from `seq` on; behind jumps on the way to a landing pattern alone."""
        return self._mission.next_place(seq) if self._kind is RtlType.DIRECT_MISSION_LAND else self._place_from(seq)

    def _next(self, seq: int) -> int | None:
        is_back = self._kind is RtlType.MISSION_FAST_REVERSE
        return self._place_before(seq) if is_back else self.next_place(seq + 1)

    # --- one item after the other -----------------------------------------------------------------------------

    def _take_up(self) -> None:
        """Take up what there is to fly now (MissionBase::update_mission)."""
        self._plan, self._seq = self._state.dataman.mission, self._state.dataman.current_seq
        self._executing = announce(self._state, ready=self._has_item, executing=self._executing)
        self._mission.begin_report()
        self._work = Work.DEFAULT if self._mission.valid else self._work

    def _item_done(self) -> None:
        assert self._target is not None
        if self._work is not Work.CLIMB:
            self._mission.tell_reached()
        if not self._target.autocontinue:
            self._target = self._target._replace(command=LOITER_UNLIM)
            return
        if self._work is Work.DEFAULT:
            following = self._next(self._seq)
            self._has_item = following is not None
            if following is None:
                tell_finished(self._state)
            else:
                self._state.dataman.current_seq = self._seq = following
        self._set_item()

    def _set_item(self) -> None:
        work, self._work = self._work, Work.DEFAULT
        if not self._has_item or not self._executing:
            self._target = None
            self._executing = False
            stay(self._state)
            return
        item = self.items[self._seq]
        self._mission.tell_progress()
        if self._climbs:
            self._climb(item)
        elif item.command not in WITH_POSITION:
            self._begin(target_of(item, self._state.home_alt_m()), Work.DEFAULT)
            tell_command(self._state, self._seq, item)
            self._commands.issue(item)
        elif self._kind is RtlType.MISSION_FAST_REVERSE:
            self._fly_back(item, work)
        elif item.command in LANDS:
            self._come_down(item, work)
        else:
            self._pass(item, self._following())

    def _climb(self, item: MissionItem) -> None:
        """Straight up, with the heading of the item that is current.

        PX4 changes that item and leaves its yaw, which shares its place with the fourth parameter of items without a
        place (mission_item_s): DO_LAND_START's zero is north.
        """
        state, self._climbs = self._state, False
        position, alt_m = state.position, math.ceil(self._return_alt_m)
        state.say(Severity.INFO, f"RTL Mission land: climb to {alt_m} m\t", "rtl_mission_land_climb", alt_m)
        is_place = item.command in WITH_POSITION
        yaw_rad = target_of(item, state.home_alt_m()).yaw_rad if is_place else item.param4
        radius_m = state.settings.nav_loiter_rad_m
        up = Target(WAYPOINT, position.lat, position.lon, self._return_alt_m, yaw_rad, loiter_radius_m=radius_m)
        self._begin(up, Work.CLIMB)
        tell_item(state, self._seq, up)
        state.fly(setpoint_of(state, up), previous=state.triplet.previous, following=state.triplet.next)

    def _pass(self, item: MissionItem, following: PositionSetpoint) -> None:
        """Fly to an item's place as to a waypoint; LOITER_TO_ALT stays one."""
        state, place = self._state, target_of(item, self._state.home_alt_m())
        if item.command != LOITER_TO_ALT:
            place = place._replace(command=WAYPOINT)
        place = place._replace(hold_s=0.0, autocontinue=True)
        self._begin(place, Work.DEFAULT)
        tell_item(state, self._seq, place, item)
        fly_leg(state, setpoint_of(state, place), following)

    def _come_down(self, item: MissionItem, work: Work) -> None:
        """The mission's landing, above its place first (MissionBase::handleLanding)."""
        state = self._state
        if state.traits.flies and work is Work.DEFAULT and not is_above(state, item.lat_deg, item.lon_deg):
            self._begin(move_to_land(state, item), Work.MOVE_TO_LAND)
            return
        land = target_of(item, state.home_alt_m())._replace(yaw_rad=math.nan)
        self._begin(land, Work.DEFAULT)
        tell_item(state, self._seq, land, item)
        flown = state.triplet.current
        if self._precland.begins_at(item):
            self._work = Work.PRECISION_LAND
        fly_leg(state, setpoint_of(state, land), self._following(), work, flown)

    def _fly_back(self, item: MissionItem, work: Work) -> None:
        """The place before; from the take-off, or the mission's first place, home and down."""
        state = self._state
        before = self._place_before(self._seq)
        following = state.triplet.next if before is None else self._setpoint_at(before)
        self._comes_down = item.command in TAKEOFFS or before is None
        if item.command not in TAKEOFFS and before is not None:
            self._pass(item, following)
        elif state.landed:
            self._take_off_again(item, following)
        elif work is Work.DEFAULT:
            self._pass(item, following)
            self._work = Work.CLIMB
        elif state.traits.flies and not is_above(state, *self._home_deg):
            self._fly_home(WAYPOINT, state.position.alt, Work.MOVE_TO_LAND)
        elif state.settings.rtl_land_delay_s < 0.0:
            self._fly_home(WAYPOINT, state.home_alt_m() + state.settings.rtl_descend_alt_m, Work.DEFAULT)
        else:
            mode = state.settings.rtl_pld_md
            precisely = mode in (Precision.OPPORTUNISTIC, Precision.REQUIRED)
            if precisely:
                self._precland.begin(Precision(mode))
            self._fly_home(LAND, state.position.alt, Work.PRECISION_LAND if precisely else Work.DEFAULT)

    def _take_off_again(self, item: MissionItem, following: PositionSetpoint) -> None:
        """After a precision landing, which leaves the item as it is: a flaw of PX4's (handleLanding of this return)."""
        state, place = self._state, target_of(item, self._state.home_alt_m())
        self._begin(place, Work.DEFAULT)
        tell_item(state, self._seq, place, item)
        state.fly(setpoint_of(state, place), previous=state.triplet.previous, following=following)

    @property
    def _home_deg(self) -> tuple[float, float]:
        home = self._state.topics.home_position
        return home.lat, home.lon

    def _fly_home(self, command: int, alt_m: float, work: Work) -> None:
        state = self._state
        home = Target(command, *self._home_deg, alt_m, loiter_radius_m=state.settings.nav_loiter_rad_m)
        self._begin(home, work)
        tell_item(state, self._seq, home)
        state.fly(setpoint_of(state, home))

    def _following(self) -> PositionSetpoint:
        place = self._next(self._seq)
        return self._state.triplet.next if place is None else self._setpoint_at(place)

    def _setpoint_at(self, seq: int) -> PositionSetpoint:
        return setpoint_of(self._state, target_of(self.items[seq], self._state.home_alt_m()))
