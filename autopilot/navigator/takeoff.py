"""TAKEOFF: climb to the height of NAV_TAKEOFF, or MIS_TAKEOFF_ALT above the ground; never descend.

PX4's Takeoff (src/modules/navigator/takeoff.cpp, v1.18). What does not fly is there as soon as it counts as in the air,
and drives back to where it was then, whatever place the command named. Where nothing is known of the Earth, the vehicle
is at 0, 0 and 0 m, as in PX4's memory: it climbs by MIS_TAKEOFF_ALT, and never counts as there.
"""

import math

from sitl_emu.autopilot.constants import SetpointType, Severity
from sitl_emu.autopilot.navigator.mission_block import TAKEOFF, Reached, Target
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import VehicleCommand, VehicleGlobalPosition

NOWHERE = VehicleGlobalPosition(lat=0.0, lon=0.0, alt=0.0)
"""As long as nobody has told a place (EKF2::PublishGlobalPosition: without an origin nobody does)."""


class Takeoff:
    """AUTO_TAKEOFF."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._command: VehicleCommand | None = None
        self._target: Target | None = None
        self._reached = Reached()

    def request(self, command: VehicleCommand) -> None:
        """NAV_TAKEOFF; lat, lon and altitude (AMSL) may be NaN, and the heading does not matter.

        Without a place it is where the vehicle is now, also where it takes off later (Navigator::run).
        """
        if not (math.isfinite(command.param5) and math.isfinite(command.param6)):
            position = self._position()
            command = command._replace(param5=position.lat, param6=position.lon)
        self._command = command
        self._target = None

    def on_activation(self) -> None:
        """Enter TAKEOFF."""
        self._begin()
        self._state.cruising_speed_m_s = -1.0

    def on_active(self) -> None:
        """Every cycle in TAKEOFF."""
        state = self._state
        if self._target is None:
            self._begin()
        elif self._reached.update(state, self._target) and not state.finished:
            state.finished = state.mission_finished = True
            state.tell_mission()
            self._hold(self._target)

    def _hold(self, target: Target) -> None:
        """Take off no longer: who flies holds there; what doesn't has another setpoint of its place."""
        state, current = self._state, self._state.triplet.current
        if state.landed:
            return
        if state.traits.flies:
            kind, lat, lon, alt_m = SetpointType.LOITER, current.lat, current.lon, current.alt
        else:
            kind, lat, lon, alt_m = state.takeoff_type, target.lat_deg, target.lon_deg, target.alt_m
        radius_m = state.acceptance_radius_m()
        setpoint = state.setpoint(kind, lat, lon, alt_m, acceptance_radius_m=radius_m)
        state.fly(setpoint._replace(loiter_radius=current.loiter_radius))

    def _position(self) -> VehicleGlobalPosition:
        position = self._state.position
        return position if position.timestamp else NOWHERE

    def _begin(self) -> None:
        state, command = self._state, self._command
        self._command = None
        position = self._position()
        lat, lon = position.lat, position.lon
        if command is not None and math.isfinite(command.param7):
            alt = command.param7
        else:
            alt = position.alt + state.settings.mis_takeoff_alt_m
            default_m = state.settings.mis_takeoff_alt_m
            text = f"Using default takeoff altitude: {default_m:.1f} m\t"
            state.say(Severity.INFO, text, "navigator_takeoff_default_alt", default_m)
        if command is not None:
            lat, lon = command.param5, command.param6
        if alt < position.alt:
            alt = position.alt
            text = "Already higher than takeoff altitude\t"
            state.say(Severity.CRITICAL, text, "navigator_takeoff_already_higher")
        self._target = Target(TAKEOFF, position.lat, position.lon, alt)
        self._reached.restart(state.now_us)
        state.finished = state.mission_finished = False
        state.tell_mission()
        state.fly(state.setpoint(state.takeoff_type, lat, lon, alt, acceptance_radius_m=state.acceptance_radius_m()))
