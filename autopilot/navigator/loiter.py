"""HOLD: stay at the setpoint that was reached, else where the vehicle comes to rest; go where DO_REPOSITION says.

PX4's Loiter (src/modules/navigator/loiter.cpp, v1.18), and what Navigator::run does with repositions. On the ground the
setpoint stays what it is: none, or that of a takeoff that HOLD has ended too early, which goes on so. A reposition is
worked out when it is commanded, by the setpoint of the mode that is flown then, and counts for half a second: one that
is not flown by then, because HOLD was refused, is not flown later. With NAV_LTR_LAST_DL a failsafe's HOLD without a
ground station goes back to where one was heard last.
"""

import math

from sitl_emu.autopilot.constants import HEARTBEAT_TOLD_US, SetpointType, Severity
from sitl_emu.autopilot.navigator.geofence import Geofence
from sitl_emu.autopilot.navigator.mission_legs import hold_at
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import PositionSetpoint, VehicleCommand
from sitl_emu.core.geodesy import distance_m

REPOSITION_US = 500_000
"""Loiter::on_active, how old a reposition may be."""
OUTSIDE = "navigator_reposition_outside_geofence"
ALTITUDE_OUTSIDE = "navigator_change_altitude_outside_geofence"


class Loiter:
    """AUTO_LOITER."""

    def __init__(self, state: NavigatorState, geofence: Geofence) -> None:
        self._state = state
        self._geofence = geofence
        self._asked: PositionSetpoint | None = None
        """Where to go; its timestamp says since when."""
        self._last_link = (math.nan, math.nan, math.nan, math.nan)
        """Where a ground station was heard last: lat_deg, lon_deg, altitude AMSL, heading; NaN: never."""
        self._goes_to_last_link = False

    # --- from outside ---------------------------------------------------------------------------------------

    def reposition(self, command: VehicleCommand, *, in_hold: bool) -> None:
        """DO_REPOSITION, for when it is active, not while disarmed. Refused beyond the fence, with PX4's text."""
        state, position, current = self._state, self._state.position, self._state.triplet.current
        lat, lon, alt_m = command.param5, command.param6, command.param7
        has_place, has_altitude = math.isfinite(lat) and math.isfinite(lon), math.isfinite(alt_m)
        alt_m = alt_m if has_altitude else position.alt
        radius_m = 0.0
        inside = (lat, lon, alt_m) if has_place else (position.lat, position.lon, alt_m)
        if not self._may_go(inside, "Reposition is outside geofence\t", OUTSIDE):
            return
        if not has_place:
            if has_altitude or math.isfinite(command.param4):
                lat, lon = self._kept_place()
                radius_m = self._kept_radius_m() if has_altitude else radius_m
            elif current.type != SetpointType.TAKEOFF:
                lat, lon = state.stop_point()
            else:
                lat, lon = position.lat, position.lon
        speed_m_s = command.param1 if math.isfinite(command.param1) and command.param1 > 0.0 else self._speed(in_hold)
        self._ask((lat, lon, alt_m), command.param4, speed_m_s, radius_m)

    def change_altitude(self, altitude_amsl_m: float, *, in_hold: bool) -> None:
        """DO_CHANGE_ALTITUDE, at the setpoint's place; NaN: to the present altitude."""
        position = self._state.position
        alt_m = altitude_amsl_m if math.isfinite(altitude_amsl_m) else position.alt
        refusal = "Altitude change is outside geofence\t"
        if self._may_go((position.lat, position.lon, alt_m), refusal, ALTITUDE_OUTSIDE):
            place = (*self._kept_place(), alt_m)
            self._ask(place, math.nan, self._speed(in_hold), self._kept_radius_m())

    def hold_here(self) -> None:
        """Come back to this place when HOLD is entered next: where the fence was broken."""
        state = self._state
        self._ask(self._geofence.place(), math.nan, state.cruising_speed_m_s, state.settings.nav_loiter_rad_m)

    def _may_go(self, place: tuple[float, float, float], refusal: str, event: str) -> bool:
        state = self._state
        if not state.armed:
            return False
        if state.settings.gf_action >= 2 and not self._geofence.allows(*place):
            state.say(Severity.CRITICAL, refusal, event)
            return False
        self._geofence.forget_hold()
        return True

    def _kept_place(self) -> tuple[float, float]:
        """The setpoint's, else the vehicle's."""
        current, position = self._state.triplet.current, self._state.position
        lat = current.lat if math.isfinite(current.lat) else position.lat
        return lat, current.lon if math.isfinite(current.lon) else position.lon

    def _kept_radius_m(self) -> float:
        radius_m = self._state.triplet.current.loiter_radius
        return radius_m if math.isfinite(radius_m) and radius_m > 0.0 else self._state.settings.nav_loiter_rad_m

    def _speed(self, in_hold: bool) -> float:
        return self._state.cruising_speed_m_s if in_hold else -1.0

    def _ask(self, place: tuple[float, float, float], yaw_rad: float, speed_m_s: float, radius_m: float) -> None:
        state = self._state
        setpoint = state.setpoint(SetpointType.LOITER, *place, yaw_rad, state.acceptance_radius_m())
        self._asked = setpoint._replace(cruising_speed=speed_m_s, loiter_radius=radius_m, alt_acceptance_radius=0.0)

    def note_ground_station(self) -> None:
        """Every cycle, whatever is flown: remember where a ground station was heard (Navigator::run)."""
        state = self._state
        heard_us = state.topics.gcs_heartbeats.gcs_us
        if heard_us > 0 and state.now_us - heard_us <= HEARTBEAT_TOLD_US:
            position = state.position
            self._last_link = (position.lat, position.lon, position.alt, state.topics.vehicle_local_position.heading)

    # --- as a mode ------------------------------------------------------------------------------------------

    def on_activation(self) -> None:
        """Enter HOLD."""
        self._goes_to_last_link = False
        if not self._go_where_asked():
            self._stay()
        self._state.cruising_speed_m_s = -1.0

    def on_active(self) -> None:
        """Every cycle in HOLD."""
        self._go_where_asked()
        if not self._wants_last_link():
            self._goes_to_last_link = False
        elif not self._goes_to_last_link:
            self._goes_to_last_link = True
            self._stay()

    def _wants_last_link(self) -> bool:
        status = self._state.topics.vehicle_status
        return self._state.settings.nav_ltr_last_dl and status.failsafe and status.gcs_connection_lost

    def _go_where_asked(self) -> bool:
        state, asked = self._state, self._asked
        if asked is None or state.now_us - asked.timestamp >= REPOSITION_US:
            return False
        self._asked = None
        # Where a leg would begin is noted, but whether it is valid stays as it was (Loiter::reposition).
        position, heading = state.position, state.topics.vehicle_local_position.heading
        previous = state.triplet.previous._replace(lat=position.lat, lon=position.lon, alt=position.alt, yaw=heading)
        state.fly(asked, previous=previous, following=state.triplet.next._replace(valid=False))
        return True

    def _stay(self) -> None:
        """Loiter::set_loiter_position."""
        state, current = self._state, self._state.triplet.current
        if state.landed:
            state.fly(current)
        elif self._wants_last_link():
            state.fly(self._at_last_link())
        elif self._holds_already(current):
            state.fly(hold_at(state, current))
        else:
            place, radius_m = (*state.stop_point(), state.loiter_alt_m()), state.acceptance_radius_m()
            state.fly(state.setpoint(SetpointType.LOITER, *place, acceptance_radius_m=radius_m))

    def _at_last_link(self) -> PositionSetpoint:
        """MissionBlock::setLoiterFromLastLink."""
        state, position = self._state, self._state.position
        here = position.lat, position.lon, position.alt
        lat, lon, alt_m = (
            last if math.isfinite(last) else now for last, now in zip(self._last_link[:3], here, strict=True)
        )
        radius_m = state.acceptance_radius_m()
        return state.setpoint(SetpointType.LOITER, lat, lon, alt_m, self._last_link[3], radius_m)

    def _holds_already(self, current: PositionSetpoint) -> bool:
        """Whether the vehicle is within the circle that a fixed wing would fly around a setpoint of HOLD."""
        if not current.valid or current.type != SetpointType.LOITER or not math.isfinite(current.lat + current.lon):
            return False
        state, position = self._state, self._state.position
        away_m = distance_m(current.lat, current.lon, position.lat, position.lon)
        return away_m <= state.acceptance_radius_m() + current.loiter_radius
