"""Precision landing: onto a target that LANDING_TARGET tells of. PX4's PrecLand (v1.18).

From where it stands the vehicle flies above the target, descends above it once it is within PLD_HACC_RAD, and lands.
Without a target in sight a landing that requires one (AUTO_PRECLAND, RTL_PLD_MD 2, precision 2 of a mission's landing)
climbs to PLD_SRCH_ALT and searches for PLD_SRCH_TOUT, at most PLD_MAX_SRCH times; an opportunistic one, and one that
has searched in vain, lands where it is. A target that is lost below PLD_FAPPR_ALT is landed upon.

Left out: the target's yaw (PLD_YAW_EN), targets that move.
"""

import math
from enum import Enum, IntEnum

from sitl_emu.autopilot.constants import SetpointType
from sitl_emu.autopilot.navigator.mission_block import LAND, Target
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.topics import LandingTargetPose
from sitl_emu.core.geodesy import MapProjection, distance_m

START_US = 2_000_000
"""So long it looks for the target before it searches."""
LOST_NEAR_GROUND_US = 500_000


class Precision(IntEnum):
    """RTL_PLD_MD, and param2 of NAV_LAND."""

    DISABLED = 0
    OPPORTUNISTIC = 1
    REQUIRED = 2


class Phase(Enum):
    """PX4's PrecLandState."""

    START = "start"
    APPROACH = "horizontal approach"
    DESCEND = "descend above target"
    FINAL = "final approach"
    SEARCH = "search"
    FALLBACK = "fallback"


class PrecLand:
    """Flown as AUTO_PRECLAND, and by RTL and missions for their landing."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._required = True
        self._phase = Phase.START
        self._since_us = 0
        self._searches = 0
        self._start = (math.nan, math.nan, math.nan)
        self._approach_alt_m = math.nan
        self._seen: LandingTargetPose | None = None

    def on_activation(self) -> None:
        """AUTO_PRECLAND: the target is required."""
        position = self._state.position
        self.begin(position.lat, position.lon, position.alt, Precision.REQUIRED)

    def begin(self, lat_deg: float, lon_deg: float, alt_m: float, precision: Precision) -> None:
        """Look for the target from a place."""
        self._required = precision is Precision.REQUIRED
        self._start = (lat_deg, lon_deg, alt_m)
        self._searches = 0
        self._enter_start()

    def begins_at(self, item: MissionItem, target: Target) -> bool:
        """Begin with a mission's landing that asks for it; False for any other item."""
        wants = item.command == LAND and item.param2 in (Precision.OPPORTUNISTIC, Precision.REQUIRED)
        if not wants or not self._state.traits.lands_precisely:
            return False
        self.begin(target.lat_deg, target.lon_deg, self._state.position.alt, Precision(int(item.param2)))
        return True

    def on_active(self) -> None:
        """Every cycle."""
        state, phase = self._state, self._phase
        if state.landed and not state.armed:
            state.finished = True
            return
        elapsed_us = state.now_us - self._since_us
        if phase in (Phase.START, Phase.SEARCH) and self._visible():
            self._approach_alt_m = state.position.alt
            self._enter(Phase.APPROACH)
        elif phase is Phase.START:
            self._wait_at_start(elapsed_us)
        elif phase is Phase.SEARCH:
            if elapsed_us > state.settings.pld_srch_tout_s * 1e6:
                self._fall_back()
        elif phase is Phase.APPROACH:
            self._fly_above()
        elif phase is Phase.DESCEND:
            self._descend()

    # --- phases ---------------------------------------------------------------------------------------------

    def _enter(self, phase: Phase) -> None:
        self._phase, self._since_us = phase, self._state.now_us

    def _enter_start(self) -> None:
        if self._searches > self._state.settings.pld_max_srch:
            self._fall_back()
            return
        self._enter(Phase.START)
        self._fly(SetpointType.POSITION, *self._start)

    def _wait_at_start(self, elapsed_us: int) -> None:
        state = self._state
        lat, lon, _ = self._start
        away_m = distance_m(lat, lon, state.position.lat, state.position.lon)
        if elapsed_us < START_US or not away_m < state.settings.nav_acc_rad_m:
            return
        self._searches += 1
        if not self._required or self._searches > state.settings.pld_max_srch:
            self._fall_back()
            return
        home_alt_m = state.home_alt_m()
        self._enter(Phase.SEARCH)
        self._fly(SetpointType.POSITION, lat, lon, home_alt_m + state.settings.pld_srch_alt_m)

    def _fly_above(self) -> None:
        if not self._visible():
            self._enter_start()
            return
        target = self._target()
        local = self._state.topics.vehicle_local_position
        if math.hypot(target.x_abs - local.x, target.y_abs - local.y) < self._state.settings.pld_hacc_rad_m:
            self._enter(Phase.DESCEND)
            self._land_on(target)
            return
        self._follow(SetpointType.POSITION, target, self._approach_alt_m)

    def _descend(self) -> None:
        state, local = self._state, self._state.topics.vehicle_local_position
        low = local.dist_bottom_valid and local.dist_bottom < state.settings.pld_fappr_alt_m
        seen_us = self._target().timestamp
        if low and state.now_us - seen_us > LOST_NEAR_GROUND_US:
            self._enter(Phase.FINAL)
        elif not low and not self._visible() and not state.landed:
            self._enter_start()
        else:
            self._land_on(self._target())

    def _fall_back(self) -> None:
        """Land where it is."""
        self._enter(Phase.FALLBACK)
        lat, lon = self._state.stop_point()
        self._fly(SetpointType.LAND, lat, lon, self._state.position.alt)

    # --- target ---------------------------------------------------------------------------------------------

    def _target(self) -> LandingTargetPose:
        return self._state.topics.landing_target_pose

    def _visible(self) -> bool:
        target = self._target()
        timeout_us = self._state.settings.pld_btout_s * 1e6
        known = self._state.topics.vehicle_local_position.xy_valid
        return known and target.timestamp > 0 and self._state.now_us - target.timestamp < timeout_us

    def _land_on(self, target: LandingTargetPose) -> None:
        self._follow(SetpointType.LAND, target, self._state.position.alt)

    def _follow(self, kind: SetpointType, target: LandingTargetPose, alt_m: float) -> None:
        if target is self._seen and self._state.triplet.current.type == kind:
            return
        self._seen = target
        local = self._state.topics.vehicle_local_position
        if math.isfinite(local.ref_lat):
            lat, lon = MapProjection(local.ref_lat, local.ref_lon).reproject(target.x_abs, target.y_abs)
            self._fly(kind, lat, lon, alt_m)

    def _fly(self, kind: SetpointType, lat_deg: float, lon_deg: float, alt_m: float) -> None:
        self._state.fly(self._state.setpoint(kind, lat_deg, lon_deg, alt_m))
