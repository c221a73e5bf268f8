"""HOLD: stay at the setpoint that was reached, else where the vehicle comes to rest; go where DO_REPOSITION says.

PX4's Loiter (src/modules/navigator/loiter.cpp, v1.18). On the ground the setpoint is idle. A reposition counts for half
a second: one that is not flown by then, because HOLD was refused, is not flown later.
"""

import math

from sitl_emu.autopilot.constants import SetpointType, Severity
from sitl_emu.autopilot.navigator.geofence import Geofence
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import PositionSetpoint, VehicleCommand
from sitl_emu.core import dialect as mavlink
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
        self._reposition: VehicleCommand | None = None
        self._reposition_us = 0
        self._broken_at: tuple[float, float, float] | None = None

    def reposition(self, command: VehicleCommand) -> None:
        """DO_REPOSITION, for when it is active, not while disarmed. Refused beyond the fence, with PX4's text."""
        self._reposition_inside_fence(command, "Reposition is outside geofence\t", OUTSIDE)

    def change_altitude(self, altitude_amsl_m: float) -> None:
        """DO_CHANGE_ALTITUDE: a reposition of which only the altitude is given; NaN keeps the present one."""
        nan = math.nan
        command = VehicleCommand(mavlink.MAV_CMD_DO_REPOSITION, nan, nan, nan, nan, nan, nan, altitude_amsl_m)
        self._reposition_inside_fence(command, "Altitude change is outside geofence\t", ALTITUDE_OUTSIDE)

    def _reposition_inside_fence(self, command: VehicleCommand, refusal: str, event: str) -> None:
        state = self._state
        lat, lon, alt = self._destination(command)
        if state.settings.gf_action >= 2 and not self._geofence.allows(lat, lon, alt):
            state.say(Severity.CRITICAL, refusal, event)
            self._reposition = None
            return
        self._geofence.forget_hold()
        self._reposition, self._reposition_us = command if state.armed else None, state.now_us

    def hold_here(self) -> None:
        """Come back to this place when HOLD is entered next: where the fence was broken."""
        position = self._state.position
        self._broken_at, self._reposition_us = (position.lat, position.lon, position.alt), self._state.now_us

    def on_activation(self) -> None:
        """Enter HOLD."""
        if not self._go_where_asked(-1.0):
            self._stay()
        self._state.cruising_speed_m_s = -1.0

    def on_active(self) -> None:
        """Every cycle in HOLD."""
        if not self._go_where_asked(self._state.cruising_speed_m_s) and self._broken_at is not None:
            self._stay()

    def _go_where_asked(self, speed_m_s: float) -> bool:
        command, self._reposition = self._reposition, None
        if command is None or self._state.now_us - self._reposition_us >= REPOSITION_US:
            return False
        self._go(command, speed_m_s)
        return True

    def _stay(self) -> None:
        state = self._state
        if state.landed:
            state.idle()
            return
        current = state.triplet.current
        broken_at, self._broken_at = self._broken_at, None
        if broken_at is not None and state.now_us - self._reposition_us < REPOSITION_US:
            (lat, lon, alt), yaw = broken_at, math.nan
        elif self._holds_already(current):
            lat, lon, alt, yaw = current.lat, current.lon, current.alt, current.yaw
        else:
            lat, lon = state.stop_point()
            alt, yaw = state.position.alt, math.nan
        state.fly(state.setpoint(SetpointType.LOITER, lat, lon, alt, yaw))

    def _holds_already(self, current: PositionSetpoint) -> bool:
        """Whether the vehicle is within the circle that a fixed wing would fly around a setpoint of HOLD."""
        if not current.valid or current.type != SetpointType.LOITER or not math.isfinite(current.lat + current.lon):
            return False
        state, position = self._state, self._state.position
        away_m = distance_m(current.lat, current.lon, position.lat, position.lon)
        return away_m <= state.acceptance_radius_m() + current.loiter_radius

    def _destination(self, command: VehicleCommand) -> tuple[float, float, float]:
        position = self._state.position
        finite = math.isfinite(command.param5) and math.isfinite(command.param6)
        lat, lon = (command.param5, command.param6) if finite else (position.lat, position.lon)
        return lat, lon, command.param7 if math.isfinite(command.param7) else position.alt

    def _go(self, command: VehicleCommand, speed_m_s: float) -> None:
        """Fly there, at the command's speed, or else this one."""
        state = self._state
        lat, lon, alt = self._destination(command)
        current = state.triplet.current
        if not (math.isfinite(command.param5) and math.isfinite(command.param6)):
            if not (math.isfinite(command.param7) or math.isfinite(command.param4)):
                lat, lon = state.stop_point() if current.type != SetpointType.TAKEOFF else (lat, lon)
            elif math.isfinite(current.lat + current.lon):
                lat, lon = current.lat, current.lon
        speed = command.param1 if math.isfinite(command.param1) and command.param1 > 0.0 else speed_m_s
        setpoint = state.setpoint(SetpointType.LOITER, lat, lon, alt, command.param4)
        # Where a leg would begin is noted, but whether it is valid stays as it was (Loiter::reposition).
        position, heading = state.position, state.topics.vehicle_local_position.heading
        previous = state.triplet.previous._replace(lat=position.lat, lon=position.lon, alt=position.alt, yaw=heading)
        state.fly(setpoint._replace(cruising_speed=speed), previous=previous)
