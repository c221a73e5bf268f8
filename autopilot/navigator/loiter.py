"""HOLD: stay at the setpoint that was reached, else where the vehicle comes to rest; go where DO_REPOSITION says.

PX4's Loiter (src/modules/navigator/loiter.cpp, v1.18). On the ground the setpoint is idle.
"""

import math

from autopilot.constants import NavState, SetpointType, Severity
from autopilot.navigator.geofence import Geofence
from autopilot.navigator.state import NavigatorState
from autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink

OUTSIDE = "navigator_reposition_outside_geofence"
ALTITUDE_OUTSIDE = "navigator_change_altitude_outside_geofence"


class Loiter:
    """AUTO_LOITER."""

    def __init__(self, state: NavigatorState, geofence: Geofence) -> None:
        self._state = state
        self._geofence = geofence
        self._reposition: VehicleCommand | None = None
        self._idle = False
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
        self._reposition = command if state.armed else None

    def hold_here(self) -> None:
        """Come back to this place when HOLD is entered next: where the fence was broken."""
        position = self._state.position
        self._broken_at = (position.lat, position.lon, position.alt)

    def on_activation(self) -> None:
        """Enter HOLD."""
        self._stay()

    def on_active(self) -> None:
        """Every cycle in HOLD."""
        if self._reposition is not None:
            command, self._reposition = self._reposition, None
            self._go(command)
        elif (self._idle and not self._state.landed) or self._broken_at is not None:
            self._stay()

    def _stay(self) -> None:
        state = self._state
        self._idle = state.landed
        if state.landed:
            state.idle()
            return
        current = state.triplet.current
        if self._broken_at is not None:
            (lat, lon, alt), yaw = self._broken_at, math.nan
            self._broken_at = None
        elif state.can_loiter_at_setpoint and current.valid and math.isfinite(current.lat):
            lat, lon, alt, yaw = current.lat, current.lon, current.alt, current.yaw
        else:
            lat, lon = state.stop_point()
            alt, yaw = state.position.alt, math.nan
        state.fly(state.setpoint(SetpointType.LOITER, lat, lon, alt, yaw))
        state.can_loiter_at_setpoint = True

    def _destination(self, command: VehicleCommand) -> tuple[float, float, float]:
        position = self._state.position
        finite = math.isfinite(command.param5) and math.isfinite(command.param6)
        lat, lon = (command.param5, command.param6) if finite else (position.lat, position.lon)
        return lat, lon, command.param7 if math.isfinite(command.param7) else position.alt

    def _go(self, command: VehicleCommand) -> None:
        state = self._state
        lat, lon, alt = self._destination(command)
        current = state.triplet.current
        if not (math.isfinite(command.param5) and math.isfinite(command.param6)) and current.valid:
            lat, lon = (current.lat, current.lon) if math.isfinite(current.lat) else (lat, lon)
        was_loitering = state.topics.vehicle_status.nav_state is NavState.AUTO_LOITER
        if math.isfinite(command.param1) and command.param1 > 0.0:
            state.cruising_speed_m_s = command.param1
        elif not was_loitering:
            state.cruising_speed_m_s = -1.0
        self._idle = False
        state.can_loiter_at_setpoint = True
        state.fly(
            state.setpoint(SetpointType.LOITER, lat, lon, alt, command.param4),
            previous=state.here(),
        )
