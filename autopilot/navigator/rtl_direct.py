"""The straight return: climb, fly there, descend, land. PX4's RtlDirect (src/modules/navigator/rtl_direct.cpp, v1.18).

It is left straight up, with the heading of that moment, to the height that `rtl.py` has worked out. With RTL_LAND_DELAY
0 the vehicle lands as soon as it is within the acceptance radius; else it descends to RTL_DESCEND_ALT first and waits
there (negative: for good), whatever its height is then, and turns to its heading before it lands. On the ground it
stays there. What does not fly goes straight home. RTL_PLD_MD makes the landing a precision landing.
"""

import math
from enum import IntEnum
from typing import NamedTuple

from sitl_emu.autopilot.constants import SetpointType, Severity
from sitl_emu.autopilot.navigator.mission_block import (
    LAND,
    LOITER_TIME,
    LOITER_TO_ALT,
    LOITER_UNLIM,
    NAV_CMD_IDLE,
    WAYPOINT,
    Reached,
    Target,
    keep_off_ground,
    tell_item,
)
from sitl_emu.autopilot.navigator.mission_legs import setpoint_of
from sitl_emu.autopilot.navigator.precland import Precision, PrecLand
from sitl_emu.autopilot.navigator.rtl_time import along_s, vertical_s
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import VehicleCommand, VehicleGlobalPosition
from sitl_emu.core.c_types import float32
from sitl_emu.core.geodesy import distance_m

ANY_HEIGHT_M = 3.4028234663852886e38
"""FLT_MAX."""


class Phase(IntEnum):
    """Where the return is: RtlDirect::RTLState without those of a VTOL."""

    CLIMB = 0
    RETURN = 1
    DESCEND = 2
    WAIT = 3
    HOVER = 6
    """MOVE_TO_LAND_HOVER: above the place, turning to the heading there."""
    LAND = 7
    LANDED = 8


class Destination(NamedTuple):
    """Where it ends; altitude AMSL of the ground there, a float32 as PX4 has it."""

    lat_deg: float
    lon_deg: float
    alt_m: float
    yaw_rad: float = math.nan
    """To arrive with; NaN: any."""


class RtlDirect:
    """AUTO_RTL, straight."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._phase = Phase.CLIMB
        self._destination = Destination(math.nan, math.nan, math.nan)
        self._return_alt_m = math.nan
        self._target: Target | None = None
        self._loiter_radius_m = 0.0
        """Of the circle that was asked for last, in whichever return: places without one keep it (mission_item_s)."""
        self._reached = Reached()
        self._precland = PrecLand(state)

    def choose(self, destination: Destination, return_alt_m: float) -> None:
        """Where the next return goes, and how high (AMSL)."""
        self._destination, self._return_alt_m = destination, return_alt_m
        self._phase = self._first_phase()

    def on_activation(self) -> None:
        """Begin to return to what was chosen."""
        state = self._state
        state.cruising_speed_m_s = -1.0
        return_alt_m = float32(self._return_alt_m)
        amsl_m, above_whole_m = math.ceil(return_alt_m), math.ceil(float32(return_alt_m - self._destination.alt_m))
        text = f"RTL: start return at {amsl_m} m ({above_whole_m} m above destination)\t"
        if not state.traits.flies:
            self._phase = Phase.LAND
            self._fly_phase()
            state.say(Severity.INFO, text, "vrtl_return_at", amsl_m, above_whole_m)
            return
        state.say(Severity.INFO, text, "vrtl_return_at", amsl_m, above_whole_m)
        if state.landed:
            self._land()
            return
        self._phase = self._first_phase()
        self._fly_phase()

    def on_active(self) -> None:
        """Every cycle of the return."""
        state = self._state
        if self._phase is Phase.LANDED:
            return
        assert self._target is not None
        if self._reached.update(state, self._target):
            if self._phase is Phase.LAND:
                self._land()
                return
            self._phase = self._next_phase()
            self._fly_phase()
        self._target = keep_off_ground(state, self._target)
        if self._phase is Phase.LAND and self._precision is not Precision.DISABLED:
            self._precland.on_active()

    def seconds_left(self) -> float:
        """How long the rest of the return would take, or all of it while none is flown (calc_rtl_time_estimate).

        Along the ground it is 0, standing or driving: PX4 counts the way down alone, for a rover's return has no phase
        but LAND (getActivationState). NaN where it has ended, and for who flies and has landed.
        """
        if not self._state.traits.flies:
            return math.nan if self._phase is Phase.LANDED else 0.0
        return math.nan if self._state.landed else self._seconds_left(self._state.position)

    @property
    def is_landing(self) -> bool:
        """It has come to the place."""
        return Phase.DESCEND <= self._phase < Phase.LANDED

    @property
    def _precision(self) -> Precision:
        """RTL_PLD_MD."""
        mode = self._state.settings.rtl_pld_md
        return Precision(mode) if mode in (1, 2) else Precision.DISABLED

    def _first_phase(self) -> Phase:
        goes_to_height = self._state.position.alt < self._return_alt_m or self._state.return_alt_enforced
        return Phase.CLIMB if goes_to_height else Phase.RETURN

    def _seconds_left(self, position: VehicleGlobalPosition) -> float:
        state, place, phase = self._state, self._destination, self._phase
        hover_alt_m, seconds, settings = self._hover_alt_m, 0.0, state.settings
        if phase is Phase.CLIMB:
            seconds += vertical_s(state, max(self._return_alt_m - position.alt, 0.0))
        if phase <= Phase.RETURN:
            seconds += along_s(state, distance_m(position.lat, position.lon, place.lat_deg, place.lon_deg))
        if phase <= Phase.DESCEND:
            from_m = position.alt if phase is Phase.DESCEND else self._return_alt_m
            seconds += vertical_s(state, hover_alt_m - from_m)
        if phase <= Phase.WAIT:
            if settings.rtl_land_delay_s < 0.0:
                return seconds
            seconds += settings.rtl_land_delay_s
        if phase is Phase.HOVER:
            seconds += along_s(state, distance_m(position.lat, position.lon, place.lat_deg, place.lon_deg))
        from_m = position.alt if phase >= Phase.LAND else hover_alt_m
        return seconds + vertical_s(state, place.alt_m - from_m)

    def _land(self) -> None:
        """On the ground. PX4 publishes its idle item as a command (RtlDirect::set_rtl_item)."""
        state, settings = self._state, self._state.settings
        self._phase, state.finished = Phase.LANDED, True
        idle = (0.0, settings.nav_acc_rad_m, settings.nav_loiter_rad_m, math.nan, 0.0, 0.0, state.home_alt_m())
        home = state.topics.home_position
        self._loiter_radius_m = settings.nav_loiter_rad_m
        place = Target(NAV_CMD_IDLE, home.lat, home.lon, state.home_alt_m(), loiter_radius_m=self._loiter_radius_m)
        tell_item(state, int(self._phase), place)
        state.tell(VehicleCommand(NAV_CMD_IDLE, *idle))

    def _away_m(self) -> float:
        place, position = self._destination, self._state.position
        return distance_m(place.lat_deg, place.lon_deg, position.lat, position.lon)

    @property
    def _hover_alt_m(self) -> float:
        """AMSL height at which it waits."""
        return min(self._destination.alt_m + self._state.settings.rtl_descend_alt_m, self._return_alt_m)

    def _yaw_rad(self) -> float:
        """Heading to fly with: the destination's near it and above it; none where the wind may turn it (WV_EN)."""
        if self._state.settings.wv_en:
            return math.nan
        close = self._phase is Phase.RETURN and self._away_m() < self._state.settings.rtl_min_dist_m
        return self._destination.yaw_rad if close or self._phase >= Phase.DESCEND else math.nan

    def _next_phase(self) -> Phase:
        settings = self._state.settings
        if self._phase is Phase.CLIMB:
            return Phase.RETURN
        if self._phase is Phase.RETURN:
            return Phase.DESCEND if settings.rtl_land_delay_s != 0.0 else Phase.LAND
        if self._phase is Phase.DESCEND:
            return Phase.WAIT
        return Phase.HOVER if self._phase is Phase.WAIT else Phase.LAND

    def _fly_phase(self) -> None:
        state, place, phase = self._state, self._destination, self._phase
        yaw_rad, hover_alt_m, delay_s = self._yaw_rad(), self._hover_alt_m, state.settings.rtl_land_delay_s
        following, accepted_m = state.triplet.next, math.nan
        if phase is Phase.CLIMB:
            heading_rad = math.nan if state.settings.wv_en else state.topics.vehicle_local_position.heading
            position = state.position
            target = Target(LOITER_TO_ALT, position.lat, position.lon, self._return_alt_m, heading_rad)
            self._loiter_radius_m = state.settings.nav_loiter_rad_m
        elif phase is Phase.RETURN:
            target = Target(WAYPOINT, place.lat_deg, place.lon_deg, self._return_alt_m, yaw_rad)
        elif phase is Phase.DESCEND:
            target = Target(LOITER_TO_ALT, place.lat_deg, place.lon_deg, hover_alt_m, yaw_rad)
            self._loiter_radius_m = state.settings.rtl_loiter_rad_m
            there = following._replace(valid=True, lat=place.lat_deg, lon=place.lon_deg)
            following = there._replace(type=int(SetpointType.LAND))
        elif phase is Phase.WAIT:
            command = LOITER_UNLIM if delay_s < 0.0 else LOITER_TIME
            target = Target(command, place.lat_deg, place.lon_deg, hover_alt_m, hold_s=delay_s)
            self._loiter_radius_m = state.settings.rtl_loiter_rad_m
            if delay_s < 0.0:
                state.say(Severity.INFO, "RTL: completed, loitering\t", "rtl_completed_loiter")
            else:
                accepted_m = ANY_HEIGHT_M
        elif phase is Phase.HOVER:
            target = Target(WAYPOINT, place.lat_deg, place.lon_deg, hover_alt_m, yaw_rad)
            accepted_m = ANY_HEIGHT_M
        else:
            target = Target(LAND, place.lat_deg, place.lon_deg, place.alt_m, yaw_rad)
            state.say(Severity.INFO, "RTL: land at destination\t", "rtl_land_at_destination")
        self._target = target = target._replace(loiter_radius_m=self._loiter_radius_m)
        self._reached.restart(state.now_us)
        tell_item(state, int(phase), target)
        if phase is Phase.LAND and self._precision is not Precision.DISABLED:
            self._precland.begin(self._precision)
            following = state.triplet.next
        setpoint = setpoint_of(state, target)._replace(alt_acceptance_radius=accepted_m)
        state.fly(setpoint, following=following)
