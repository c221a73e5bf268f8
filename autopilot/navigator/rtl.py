"""RTL: climb, return to home or to a rally point, descend, land. PX4's RTL and RtlDirect (v1.18).

RTL_TYPE 0 goes to home or to a rally point that is nearer, 1 and 5 to a rally point where there is one; 2 to 4, which
follow a mission, are flown as 0. The height is RTL_RETURN_ALT above the destination; with RTL_CONE_ANG less within
RTL_MIN_DIST, and twice the distance within NAV_ACC_RAD; it is never less than the present one. With RTL_LAND_DELAY 0
the vehicle lands as soon as it is within the acceptance radius; else it descends to RTL_DESCEND_ALT first and waits
there (negative: for good). On the ground it stays there. What does not fly goes straight home. RTL_PLD_MD makes the
landing a precision landing.
"""

import math
from enum import IntEnum
from typing import NamedTuple

from sitl_emu.autopilot.constants import SetpointType, Severity
from sitl_emu.autopilot.navigator.mission_block import (
    LAND,
    LOITER_TIME,
    LOITER_UNLIM,
    RELATIVE_FRAMES,
    WAYPOINT,
    Reached,
    Target,
    tell_item,
)
from sitl_emu.autopilot.navigator.precland import Precision, PrecLand
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import RtlStatus, RtlTimeEstimate, VehicleCommand, VehicleGlobalPosition
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import distance_m

NAV_CMD_IDLE = 0
"""Not a MAV_CMD: PX4's own (navigation.h)."""
SLOWEST_M_S = 0.1
"""Below this a speed is none, and would make a return endless."""
HOME_INDEX = 255
DIRECT_SAFE_POINT = 1
"""rtl_status.rtl_type."""
NEARER_M = 2.0
"""A rally point has to be nearer by this."""
AT_HOME_M = 10.0
"""A rally point this close to home is not another place."""


class Phase(IntEnum):
    """Where the return is."""

    CLIMB = 0
    RETURN = 1
    DESCEND = 2
    WAIT = 3
    LAND = 4
    LANDED = 5


class Destination(NamedTuple):
    """Where it ends; altitude AMSL of the ground there."""

    lat_deg: float
    lon_deg: float
    alt_m: float
    yaw_rad: float = math.nan


class Rtl:
    """AUTO_RTL."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._phase = Phase.CLIMB
        self._destination = Destination(math.nan, math.nan, math.nan)
        self._return_alt_m = math.nan
        self._target: Target | None = None
        self._reached = Reached()
        self._started = False
        self._precland = PrecLand(state)

    @property
    def _precision(self) -> Precision:
        """RTL_PLD_MD, where the vehicle can."""
        mode = self._state.settings.rtl_pld_md
        return Precision(mode) if mode in (1, 2) and self._state.traits.lands_precisely else Precision.DISABLED

    def on_activation(self) -> None:
        """Enter RTL."""
        self._start()

    def on_active(self) -> None:
        """Every cycle in RTL."""
        state = self._state
        if self._phase is Phase.LANDED:
            return
        assert self._target is not None
        if self._phase is Phase.LAND and self._precision is not Precision.DISABLED:
            self._precland.on_active()
        if self._reached.update(state, self._target):
            if self._phase is Phase.LAND:
                self._land()
                return
            self._phase = self._next_phase()
            self._fly_phase()

    def time_estimate(self, *, active: bool) -> RtlTimeEstimate:
        """How long the rest of a return would take, or all of it while none is flown (RtlDirect's, and its estimator).

        Along the ground it is 0 seconds and the margin: PX4 counts the way down alone.
        """
        state, settings = self._state, self._state.settings
        position = state.position
        if state.landed or not state.topics.home_position.valid or not math.isfinite(position.lat):
            return RtlTimeEstimate(state.now_us)
        if not (active and self._started):
            self._destination = self._nearest_destination()
            self._return_alt_m = self._return_altitude_m()
            self._phase = Phase.CLIMB if position.alt < self._return_alt_m else Phase.RETURN
        seconds = self._seconds_left(position) if state.traits.flies else 0.0
        safe_s = settings.rtl_time_factor * seconds + settings.rtl_time_margin_s
        return RtlTimeEstimate(state.now_us, True, seconds, safe_s)

    def status(self) -> RtlStatus:
        """Where a return would go: straight to home, or to a rally point."""
        state, plan = self._state, self._state.dataman.rally
        place = self._destination
        index = next(
            (n for n, item in enumerate(plan.items) if (item.lat_deg, item.lon_deg) == (place.lat_deg, place.lon_deg)),
            HOME_INDEX,
        )
        return RtlStatus(state.now_us, DIRECT_SAFE_POINT, index, plan.opaque_id)

    def _seconds_left(self, position: VehicleGlobalPosition) -> float:
        settings, place, phase = self._state.settings, self._destination, self._phase
        hover_alt_m = min(place.alt_m + settings.rtl_descend_alt_m, self._return_alt_m)
        seconds = 0.0
        if phase is Phase.CLIMB:
            seconds += self._vertical_s(max(self._return_alt_m - position.alt, 0.0))
        if phase <= Phase.RETURN:
            away_m = distance_m(position.lat, position.lon, place.lat_deg, place.lon_deg)
            seconds += away_m / max(settings.mpc_xy_cruise_m_s, SLOWEST_M_S)
        if phase <= Phase.DESCEND:
            from_m = position.alt if phase is Phase.DESCEND else self._return_alt_m
            seconds += self._vertical_s(hover_alt_m - from_m)
        if phase <= Phase.WAIT:
            if settings.rtl_land_delay_s < 0.0:
                return seconds
            seconds += settings.rtl_land_delay_s
        return seconds + self._vertical_s(place.alt_m - (position.alt if phase >= Phase.LAND else hover_alt_m))

    def _vertical_s(self, climb_m: float) -> float:
        settings = self._state.settings
        speed_m_s = settings.mpc_z_v_auto_up_m_s if climb_m > 0.0 else settings.mpc_z_v_auto_dn_m_s
        return abs(climb_m) / max(speed_m_s, SLOWEST_M_S)

    def _start(self) -> None:
        state = self._state
        self._started = True
        state.centre_gimbal()
        self._destination = self._nearest_destination()
        self._return_alt_m = self._return_altitude_m()
        state.cruising_speed_m_s = -1.0
        above_m = self._return_alt_m - self._destination.alt_m
        amsl_m, above_whole_m = math.ceil(self._return_alt_m), math.ceil(above_m - 0.01)
        text = f"RTL: start return at {amsl_m} m ({above_whole_m} m above destination)\t"
        if not state.traits.flies:
            self._phase = Phase.LAND
            self._fly_phase()
            state.say(Severity.INFO, text, "vrtl_return_at", amsl_m, above_m)
            return
        state.say(Severity.INFO, text, "vrtl_return_at", amsl_m, above_m)
        if state.landed:
            self._land()
            state.idle()
            return
        self._phase = Phase.CLIMB if state.position.alt < self._return_alt_m else Phase.RETURN
        self._fly_phase()

    def _land(self) -> None:
        """On the ground. PX4 publishes its idle item as a command (RtlDirect::set_rtl_item)."""
        state, settings = self._state, self._state.settings
        self._phase, state.finished = Phase.LANDED, True
        idle = (0.0, settings.nav_acc_rad_m, settings.nav_loiter_rad_m, math.nan, 0.0, 0.0, state.home_alt_m())
        state.tell(VehicleCommand(NAV_CMD_IDLE, *idle))

    def _nearest_destination(self) -> Destination:
        """Home, or a rally point; the heading to arrive with is home's in any case."""
        state, kind = self._state, self._state.settings.rtl_type
        home, position = state.topics.home_position, state.position
        best = Destination(home.lat, home.lon, home.alt, home.yaw)
        if kind in (2, 4):
            return best
        away_m = distance_m(home.lat, home.lon, position.lat, position.lon) if kind in (0, 3) else math.inf
        for item in state.dataman.rally.items:
            if item.command != mavlink.MAV_CMD_NAV_RALLY_POINT:
                continue
            if distance_m(item.lat_deg, item.lon_deg, home.lat, home.lon) <= AT_HOME_M:
                continue
            rally_m = distance_m(item.lat_deg, item.lon_deg, position.lat, position.lon)
            if rally_m + NEARER_M < away_m:
                alt_m = item.z + home.alt if item.frame in RELATIVE_FRAMES else item.z
                best, away_m = Destination(item.lat_deg, item.lon_deg, alt_m, home.yaw), rally_m
        return best

    def _away_m(self) -> float:
        place, position = self._destination, self._state.position
        return distance_m(place.lat_deg, place.lon_deg, position.lat, position.lon)

    def _yaw_rad(self) -> float:
        """Heading to fly with: the destination's near it and above it."""
        close = self._phase is Phase.RETURN and self._away_m() < self._state.settings.rtl_min_dist_m
        return self._destination.yaw_rad if close or self._phase >= Phase.DESCEND else math.nan

    def _return_altitude_m(self) -> float:
        state, settings = self._state, self._state.settings
        away_m, height_m = self._away_m(), settings.rtl_return_alt_m
        if settings.rtl_cone_ang_deg > 0.0 and state.traits.flies:
            if away_m <= settings.nav_acc_rad_m:
                height_m = 2.0 * away_m
            else:
                if away_m <= settings.rtl_min_dist_m:
                    half_angle = math.radians(min(max(settings.rtl_cone_ang_deg, 1.0), 89.0))
                    height_m = min(height_m, away_m / math.tan(half_angle))
                height_m = max(height_m, 2.0 * settings.nav_acc_rad_m)
        return max(self._destination.alt_m + height_m, state.position.alt)

    def _next_phase(self) -> Phase:
        settings = self._state.settings
        if self._phase is Phase.CLIMB:
            return Phase.RETURN
        if self._phase is Phase.RETURN:
            return Phase.DESCEND if settings.rtl_land_delay_s != 0.0 else Phase.LAND
        if self._phase is Phase.DESCEND:
            return Phase.WAIT
        return Phase.LAND

    def _fly_phase(self) -> None:
        state, place, phase = self._state, self._destination, self._phase
        settings, yaw = state.settings, self._yaw_rad()
        kind = SetpointType.POSITION
        if phase is Phase.CLIMB:
            target = Target(WAYPOINT, state.position.lat, state.position.lon, self._return_alt_m)
        elif phase is Phase.RETURN:
            target = Target(WAYPOINT, place.lat_deg, place.lon_deg, self._return_alt_m, yaw)
        elif phase is Phase.DESCEND:
            alt_m = min(self._return_alt_m, place.alt_m + settings.rtl_descend_alt_m)
            target = Target(WAYPOINT, place.lat_deg, place.lon_deg, alt_m, yaw, settings.nav_acc_rad_m)
        elif phase is Phase.WAIT:
            kind = SetpointType.LOITER
            command = LOITER_UNLIM if settings.rtl_land_delay_s < 0.0 else LOITER_TIME
            alt_m = min(self._return_alt_m, place.alt_m + settings.rtl_descend_alt_m)
            target = Target(command, place.lat_deg, place.lon_deg, alt_m, hold_s=settings.rtl_land_delay_s)
            if settings.rtl_land_delay_s < 0.0:
                state.say(Severity.INFO, "RTL: completed, loitering\t", "rtl_completed_loiter")
        else:
            kind = SetpointType.LAND
            target = Target(LAND, place.lat_deg, place.lon_deg, place.alt_m)
            state.say(Severity.INFO, "RTL: land at destination\t", "rtl_land_at_destination")
        self._target = target
        self._reached.restart(state.now_us)
        tell_item(state, int(phase), target)
        if phase is Phase.LAND and self._precision is not Precision.DISABLED:
            self._precland.begin(place.lat_deg, place.lon_deg, state.position.alt, self._precision)
            return
        state.fly(state.setpoint(kind, target.lat_deg, target.lon_deg, target.alt_m, yaw), previous=state.here())
