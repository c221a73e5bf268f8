"""Precision landing: onto a target that LANDING_TARGET tells of. PX4's PrecLand (src/modules/navigator, v1.18).

It looks for the target where its setpoint is. Once one is seen, the vehicle flies above it, as high as it is then, and
stays there for two seconds; then it lands, as long as the target is seen. Lost above it, or too high on the way down,
the vehicle looks again where it is; below PLD_FAPPR_ALT it lands on the last known place. Without a target in sight a
landing that requires one (AUTO_PRECLAND, RTL_PLD_MD 2, precision 2 of a mission's landing) climbs to PLD_SRCH_ALT and
searches for PLD_SRCH_TOUT (0: not at all); an opportunistic one, one that has searched in vain, and one that would look
again once more than PLD_MAX_SRCH times, lands where it is.

On the way above the target the setpoint itself moves no faster than MPC_XY_CRUISE and by MPC_ACC_HOR, and slowly enough
to stop there.

No kind of vehicle is exempt: a rover that sees no target ends its return, or its mission's landing, where it is.

Left out: the target's yaw (PLD_YAW_EN), targets that move.
"""

import math
from enum import Enum, IntEnum
from typing import Any, NamedTuple

from sitl_emu.autopilot.constants import SetpointType
from sitl_emu.autopilot.navigator.mission_block import LAND
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.topics import PrecLandStatus
from sitl_emu.core.geodesy import MapProjection, distance_m

SETTLES_US = 2_000_000
"""So long it looks for the target before it searches, and stays above it before it descends."""
SEARCH_SETTLES_US = 1_000_000
SEARCH_STOPS_WITHIN_M = 1.0
LOST_NEAR_GROUND_US = 500_000
FIRST_STEP_S = 0.05
"""PrecLand::slewrate, for want of a time before."""


class Precision(IntEnum):
    """RTL_PLD_MD, and param2 of NAV_LAND."""

    DISABLED = 0
    OPPORTUNISTIC = 1
    REQUIRED = 2


Horizontal = tuple[float, float]
"""Metres north and east."""


class Slewed(NamedTuple):
    """Where the setpoint was when it moved last, and the time before."""

    at_us: int
    place: Horizontal
    before: Horizontal


class Phase(Enum):
    """PX4's PrecLandState."""

    START = "start"
    APPROACH = "horizontal approach"
    DESCEND = "descend above target"
    FINAL = "final approach"
    SEARCH = "search"
    FALLBACK = "fallback"
    DONE = "done"


class PrecLand:
    """Flown as AUTO_PRECLAND, and by RTL and missions for their landing."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._required = True
        self._phase = Phase.START
        self._since_us = 0
        self._starts = 0
        self._there_us: int | None = None
        """When it came to the place where it looks, or above the target; in a search, when it saw that."""
        self._approach_alt_m = math.nan
        self._slewed: Slewed | None = None
        self._target = state.topics.landing_target_pose
        self._is_new = False
        """The target was told since the last cycle."""

    def on_activation(self) -> None:
        """AUTO_PRECLAND: the target is required."""
        self.begin(Precision.REQUIRED)

    def on_inactivation(self) -> None:
        """Another mode is flown: its setpoint loses its yaw, a commanded one, too (PrecLand::on_inactivation)."""
        triplet = self._state.triplet
        current = triplet.current._replace(yaw=math.nan)
        self._state.fly(current, previous=triplet.previous, following=triplet.next)

    def begin(self, precision: Precision) -> None:
        """Look for the target from the setpoint, or from here where there is none."""
        self._required = precision is Precision.REQUIRED
        self._starts, self._slewed = 0, None
        previous, current, following = self._state.triplet[1:]
        self._state.fly(current, previous=previous._replace(valid=False), following=following._replace(valid=False))
        if not current.valid:
            self._stay()
        self._start()

    def begins_at(self, item: MissionItem) -> bool:
        """Begin with a mission's landing that asks for it, in the air; False for any other item."""
        wants = item.command == LAND and item.param2 in (Precision.OPPORTUNISTIC, Precision.REQUIRED)
        if not wants or self._state.landed:
            return False
        self.begin(Precision(int(item.param2)))
        return True

    def on_active(self) -> None:
        """Every cycle."""
        state, known = self._state, self._target
        self._target = state.topics.landing_target_pose
        self._is_new = self._target is not known
        if state.landed and self._phase is not Phase.DONE:
            self._enter(Phase.DONE)
        if self._phase is Phase.START:
            self._look()
        elif self._phase is Phase.APPROACH:
            self._fly_above()
        elif self._phase is Phase.DESCEND:
            self._descend()
        elif self._phase is Phase.SEARCH:
            self._search()
        state.topics.prec_land_status = PrecLandStatus(state.now_us, self._phase is not Phase.DONE)

    # --- phases ---------------------------------------------------------------------------------------------

    def _enter(self, phase: Phase) -> None:
        self._phase, self._since_us, self._there_us = phase, self._state.now_us, None

    def _start(self) -> None:
        if self._starts > self._state.settings.pld_max_srch:
            self._fall_back()
            return
        self._starts += 1
        self._enter(Phase.START)
        self._fly(type=int(SetpointType.POSITION))

    def _look(self) -> None:
        state, current = self._state, self._state.triplet.current
        away_m = distance_m(current.lat, current.lon, state.position.lat, state.position.lon)
        if self._approach():
            return
        if not self._required:
            self._fall_back()
        elif away_m < state.acceptance_radius_m():
            if state.settings.pld_srch_tout_s <= 0.0:
                self._fall_back()
            elif self._has_been_there(SETTLES_US):
                alt_m = state.home_alt_m() + state.settings.pld_srch_alt_m
                self._enter(Phase.SEARCH)
                self._fly(type=int(SetpointType.POSITION), alt=alt_m)

    def _approach(self) -> bool:
        """Fly above the target if it is told of right now."""
        if not (self._is_new and self._visible()):
            return False
        self._approach_alt_m = self._state.position.alt
        self._enter(Phase.APPROACH)
        return True

    def _fly_above(self) -> None:
        above = self._is_above()
        if above and not self._visible():
            self._look_again()
        elif above and self._is_new and self._has_been_there(SETTLES_US):
            self._enter(Phase.DESCEND)
        else:
            self._fly_slowly(type=int(SetpointType.POSITION), alt=self._approach_alt_m)

    def _descend(self) -> None:
        state, target, visible = self._state, self._target, self._visible()
        low = visible and target.z_abs - state.topics.vehicle_local_position.z < state.settings.pld_fappr_alt_m
        if low and state.now_us - target.timestamp >= LOST_NEAR_GROUND_US:
            self._enter(Phase.FINAL)
        elif not visible:
            self._look_again()
        else:
            self._fly_to_target(type=int(SetpointType.LAND))

    def _search(self) -> None:
        state, current = self._state, self._state.triplet.current
        if self._is_new and self._visible() and self._there_us is None:
            self._there_us = state.now_us
            self._fly(alt=min(current.alt, state.position.alt + SEARCH_STOPS_WITHIN_M))
        if self._there_us is not None and self._has_been_there(SEARCH_SETTLES_US) and self._approach():
            return
        if state.now_us - self._since_us > state.settings.pld_srch_tout_s * 1e6:
            self._fall_back()

    def _look_again(self) -> None:
        self._stay()
        self._start()

    def _fall_back(self) -> None:
        """Land where it is."""
        self._enter(Phase.FALLBACK)
        self._stay()
        self._fly(type=int(SetpointType.LAND))

    def _has_been_there(self, us: int) -> bool:
        """Whether it came there so long ago; from now on, if it was not there yet."""
        if self._there_us is None:
            self._there_us = self._state.now_us
        return self._state.now_us - self._there_us > us

    # --- target ---------------------------------------------------------------------------------------------

    def _visible(self) -> bool:
        target, state = self._target, self._state
        known = state.topics.vehicle_local_position.xy_valid
        return known and target.timestamp > 0 and state.now_us - target.timestamp <= state.settings.pld_btout_s * 1e6

    def _is_above(self) -> bool:
        """Within a square around the target."""
        target, local = self._target, self._state.topics.vehicle_local_position
        away_m = max(abs(target.x_abs - local.x), abs(target.y_abs - local.y))
        return away_m < self._state.settings.pld_hacc_rad_m

    def _fly_to_target(self, **changes: Any) -> None:
        target, local = self._target, self._state.topics.vehicle_local_position
        if math.isfinite(local.ref_lat):
            lat, lon = MapProjection(local.ref_lat, local.ref_lon).reproject(target.x_abs, target.y_abs)
            self._fly(lat=lat, lon=lon, **changes)

    def _fly_slowly(self, **changes: Any) -> None:
        """Towards the target by one step of the setpoint (PrecLand::slewrate)."""
        state, target, local = self._state, self._target, self._state.topics.vehicle_local_position
        if not math.isfinite(local.ref_lat):
            return
        plane, now_us, goal = MapProjection(local.ref_lat, local.ref_lon), state.now_us, (target.x_abs, target.y_abs)
        if self._slewed is None:
            current, step_s = state.triplet.current, FIRST_STEP_S
            north, east = plane.project(current.lat, current.lon)
            before = north - local.vx * step_s, east - local.vy * step_s
            self._slewed = Slewed(now_us, (north, east), before)
        else:
            step_s = (now_us - self._slewed.at_us) * 1e-6
        if step_s > 0.0:
            goal = slewed(self._slewed, goal, step_s, state.settings.mpc_xy_cruise_m_s, state.settings.mpc_acc_hor_m_s2)
            self._slewed = Slewed(now_us, goal, self._slewed.place)
        lat, lon = plane.reproject(*goal)
        self._fly(lat=lat, lon=lon, **changes)

    def _stay(self) -> None:
        position = self._state.position
        self._fly(lat=position.lat, lon=position.lon, alt=position.alt)

    def _fly(self, **changes: Any) -> None:
        """Change the setpoint; it has no heading."""
        state = self._state
        previous, current, following = state.triplet[1:]
        current = current._replace(timestamp=state.now_us, valid=True, yaw=math.nan, **changes)
        state.fly(current, previous=previous, following=following)


def slewed(last: Slewed, goal: Horizontal, step_s: float, speed_m_s: float, acceleration_m_s2: float) -> Horizontal:
    """A setpoint's next place on its way to `goal`: no faster, and by no more, and so that it can stop there.

    The acceleration is told from its last two places as if both steps had taken `step_s`.
    """
    (north, east), (before_n, before_e) = last.place, last.before
    vn, ve = _no_more((goal[0] - north) / step_s, (goal[1] - east) / step_s, speed_m_s)
    was_n, was_e = (north - before_n) / step_s, (east - before_e) / step_s
    an, ae = _no_more((vn - was_n) / step_s, (ve - was_e) / step_s, acceleration_m_s2)
    stops_m_s = math.sqrt(max(acceleration_m_s2, 0.0) * math.hypot(north - goal[0], east - goal[1]))
    vn, ve = _no_more(was_n + an * step_s, was_e + ae * step_s, stops_m_s)
    return north + vn * step_s, east + ve * step_s


def _no_more(north: float, east: float, limit: float) -> Horizontal:
    size, limit = math.hypot(north, east), max(limit, 0.0)
    return (north * limit / size, east * limit / size) if size > limit else (north, east)
