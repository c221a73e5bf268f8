"""RTL: where a return goes, and how; which one is flown. PX4's RTL (src/modules/navigator/rtl.cpp, v1.18).

RTL_TYPE chooses: 0 goes straight to home or to a rally point that is nearer; 1 to the nearest of the mission's landing
pattern and the rally points, to home where there is neither; 3 to the nearest of all three; 5 to a rally point, and
where there is none lands where the vehicle is. 2 follows the mission to its landing, and without one goes back along
it and home; 4 does what is less by the count of items. Without a mission that can be flown both go straight home.

The height is RTL_RETURN_ALT above the destination; with RTL_CONE_ANG less within RTL_MIN_DIST, and twice the distance
within NAV_ACC_RAD; it is never less than the present one, but for a low RTL_RETURN_ALT. That of a landing pattern
stays what it was when the pattern was chosen, as PX4 works it out then alone (RTL::initRtlMissionType).
"""

import math

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.navigator.mission import Mission
from sitl_emu.autopilot.navigator.mission_block import RALLY_FRAMES, RELATIVE_FRAMES, target_of
from sitl_emu.autopilot.navigator.mission_legs import landing_of
from sitl_emu.autopilot.navigator.payload import Payload
from sitl_emu.autopilot.navigator.roi import Roi
from sitl_emu.autopilot.navigator.rtl_direct import Destination, RtlDirect
from sitl_emu.autopilot.navigator.rtl_mission import RtlMission, RtlType
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.topics import RtlStatus, RtlTimeEstimate
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32
from sitl_emu.core.geodesy import distance_m

CHECK_EVERY_US = 2_000_000
NO_RALLY_POINT = 255
"""rtl_status.safe_point_index."""
NEARER_M = 2.0
"""What is chosen instead has to be nearer by this (MIN_DIST_THRESHOLD)."""
AT_HOME_M = 10.0
"""A rally point this close to home is not another place (MAX_DIST_FROM_HOME_FOR_LAND_APPROACHES)."""
HOME_OR_RALLY, NEVER_HOME, FOLLOW_MISSION, NEAREST, SHORTER_WAY, RALLY_ALONE = range(6)
"""RTL_TYPE."""


class Rtl:
    """AUTO_RTL."""

    def __init__(self, state: NavigatorState, mission: Mission, roi: Roi, payload: Payload) -> None:
        self._state = state
        self._mission = mission
        self._direct = RtlDirect(state)
        self._along = RtlMission(state, mission, roi, payload)
        self._kind: RtlType | None = None
        self._flown_seq: int | None = None
        self._checked_us: int | None = None
        self._settings = state.settings

    def on_inactive(self) -> None:
        """Every cycle of another mode, or of none: every two seconds, where a return would go and how long it takes."""
        state = self._state
        self._along.on_inactive()
        in_mission = state.topics.vehicle_status.nav_state is NavState.AUTO_MISSION
        self._flown_seq = state.dataman.current_seq if in_mission else None
        is_due = self._is_due()
        if is_due or state.settings is not self._settings:
            self._settings = state.settings
            self._choose()
        if is_due:
            self._tell_time(active=False)

    def on_activation(self) -> None:
        """Enter RTL."""
        self._choose()
        if self._kind is RtlType.DIRECT:
            self._direct.on_activation()
        else:
            self._along.on_activation(self._flown_seq)
        self._state.centre_gimbal()

    @property
    def is_landing(self) -> bool:
        """It comes down, or is on its landing pattern."""
        return self._direct.is_landing if self._kind is RtlType.DIRECT else self._along.is_landing

    def on_active(self) -> None:
        """Every cycle in RTL."""
        if self._kind is RtlType.DIRECT:
            self._direct.on_active()
        else:
            self._along.on_active()
        if self._is_due():
            self._tell_time(active=True)

    def _is_due(self) -> bool:
        now_us = self._state.now_us
        if self._checked_us is not None and now_us - self._checked_us <= CHECK_EVERY_US:
            return False
        self._checked_us = now_us
        return True

    def _tell_time(self, *, active: bool) -> None:
        state, settings = self._state, self._state.settings
        seconds = math.nan
        if state.topics.home_position.valid and math.isfinite(state.position.lat):
            is_direct = self._kind is RtlType.DIRECT
            seconds = self._direct.seconds_left() if is_direct else self._along.seconds_left(active=active)
        estimate = RtlTimeEstimate(state.now_us)
        if math.isfinite(seconds):
            safe_s = settings.rtl_time_factor * seconds + settings.rtl_time_margin_s
            estimate = RtlTimeEstimate(state.now_us, True, seconds, safe_s)
        state.topics.rtl_time_estimate = estimate

    # --- where to -----------------------------------------------------------------------------------------------

    def _choose(self) -> None:
        """Work out where a return from here goes, and tell it (RTL::setRtlTypeAndDestination)."""
        state, rally = self._state, self._state.dataman.rally
        kind, destination, index = self._chosen()
        destination = destination._replace(alt_m=float32(destination.alt_m))
        return_alt_m = self._return_altitude_m(destination)
        self._direct.choose(destination, return_alt_m)
        if kind is not RtlType.DIRECT and kind is not self._kind:
            # A new kind has not seen yet which item was flown (RTL::initRtlMissionType).
            self._flown_seq = None
            self._along.choose(kind, return_alt_m)
        self._kind = kind
        state.topics.rtl_status = RtlStatus(state.now_us, kind, index, rally.opaque_id)

    def _chosen(self) -> tuple[RtlType, Destination, int]:
        """How, where to, and by which rally point."""
        home, wanted = self._state.topics.home_position, self._state.settings.rtl_type
        destination = Destination(home.lat, home.lon, home.alt, home.yaw)
        if wanted not in (FOLLOW_MISSION, SHORTER_WAY):
            return self._nearest(destination)
        landing, seq = landing_of(self._mission.items), self._state.dataman.current_seq
        kind = RtlType.MISSION_FAST_REVERSE
        if not self._mission.valid:
            kind = RtlType.DIRECT
        elif landing is not None and (wanted == FOLLOW_MISSION or landing.start - seq < seq):
            kind = RtlType.MISSION_FAST
        return kind, destination, NO_RALLY_POINT

    def _nearest(self, home: Destination) -> tuple[RtlType, Destination, int]:
        """The nearest of the places that RTL_TYPE allows (RTL::findRtlDestination)."""
        state, wanted, position = self._state, self._state.settings.rtl_type, self._state.position
        kind, best, index = RtlType.DIRECT, home, NO_RALLY_POINT
        away_m = math.inf if wanted in (NEVER_HOME, RALLY_ALONE) else self._away_m(home)
        landing = landing_of(self._mission.items) if wanted in (NEVER_HOME, NEAREST) and self._mission.valid else None
        if landing is not None:
            land = target_of(self._mission.items[landing.land], state.home_alt_m())
            pattern = Destination(land.lat_deg, land.lon_deg, land.alt_m, home.yaw_rad)
            if self._away_m(pattern) + NEARER_M < away_m:
                kind, best, away_m = RtlType.DIRECT_MISSION_LAND, pattern, self._away_m(pattern)
        for number, item in enumerate(state.dataman.rally.items):
            if item.command != mavlink.MAV_CMD_NAV_RALLY_POINT or item.frame not in RALLY_FRAMES or not _is_place(item):
                continue
            if wanted != RALLY_ALONE and _apart_m(home, item.lat_deg, item.lon_deg) <= AT_HOME_M:
                continue
            alt_m = item.z + state.home_alt_m() if item.frame in RELATIVE_FRAMES else item.z
            point = Destination(item.lat_deg, item.lon_deg, alt_m)
            if self._away_m(point) + NEARER_M < away_m:
                kind, best, away_m, index = RtlType.DIRECT, point, self._away_m(point), number
        if wanted == RALLY_ALONE and index == NO_RALLY_POINT:
            best = Destination(position.lat, position.lon, position.alt, home.yaw_rad)
        return kind, best, index

    def _away_m(self, place: Destination) -> float:
        return _apart_m(place, self._state.position.lat, self._state.position.lon)

    def _return_altitude_m(self, destination: Destination) -> float:
        state, settings = self._state, self._state.settings
        away_m, height_m = self._away_m(destination), settings.rtl_return_alt_m
        if settings.rtl_cone_ang_deg > 0.0 and state.traits.flies:
            if away_m <= settings.nav_acc_rad_m:
                height_m = 2.0 * away_m
            else:
                if away_m <= settings.rtl_min_dist_m:
                    half_angle = math.radians(min(max(settings.rtl_cone_ang_deg, 1.0), 89.0))
                    height_m = min(height_m, away_m / math.tan(half_angle))
                height_m = max(height_m, 2.0 * settings.nav_acc_rad_m)
            if destination.alt_m + height_m >= state.position.alt:
                # Over RTL_RETURN_ALT, but lower than this, it comes down to it: math::constrain looks at the upper
                # bound last, and here that may be the lower one.
                return destination.alt_m + min(height_m, settings.rtl_return_alt_m)
        return max(destination.alt_m + height_m, state.position.alt)


def _is_place(item: MissionItem) -> bool:
    """Whether it is on the Earth, and not where nobody has said where (RTL::extractValidSafePointPosition)."""
    lat_deg, lon_deg = abs(item.lat_deg), abs(item.lon_deg)
    return math.isfinite(item.z) and lat_deg <= 90.0 and lon_deg <= 180.0 and (lat_deg > 0.0 or lon_deg > 0.0)


def _apart_m(place: Destination, lat_deg: float, lon_deg: float) -> float:
    return distance_m(place.lat_deg, place.lon_deg, lat_deg, lon_deg)
