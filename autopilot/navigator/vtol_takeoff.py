"""VTOL_TAKEOFF: climb here, turn to where a wing would fly on, and ask for the transition to it.

PX4's VtolTakeoff (src/modules/navigator/vtol_takeoff.cpp, v1.18), which flies whatever vehicle is told to. None of ours
has wings: nobody answers what it asks for, and it stays there in this mode.
"""

import math

from sitl_emu.autopilot.navigator.mission_block import TAKEOFF, WAYPOINT, Reached, Target
from sitl_emu.autopilot.navigator.mission_legs import setpoint_of
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import bearing_rad, wrap_pi

SPECIFIED_DIRECTION = float(mavlink.VTOL_TRANSITION_HEADING_SPECIFIED)
FIXED_WING = float(mavlink.MAV_VTOL_STATE_FW)


class VtolTakeoff:
    """AUTO_VTOL_TAKEOFF."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._alt_m = 0.0
        self._place_deg = 0.0, 0.0
        self._direction_rad = math.nan
        """NaN: towards the place."""
        self._target: Target | None = None
        """None: it waits for the transition."""
        self._reached = Reached()

    def request(self, command: VehicleCommand) -> None:
        """NAV_VTOL_TAKEOFF: height (AMSL) of the transition, the place beyond it; a direction stays for the next."""
        self._alt_m, self._place_deg = command.param7, (command.param5, command.param6)
        if command.param2 == SPECIFIED_DIRECTION:
            self._direction_rad = math.radians(command.param4)

    def on_activation(self) -> None:
        """Enter VTOL_TAKEOFF, here."""
        state, position = self._state, self._state.position
        state.finished = state.mission_finished = False
        state.tell_mission()
        radius_m, circle_m = state.acceptance_radius_m(), state.settings.nav_loiter_rad_m
        place = position.lat, position.lon, self._alt_m
        up = Target(TAKEOFF, *place, acceptance_radius_m=radius_m, loiter_radius_m=circle_m)
        self._begin(up)
        state.fly(setpoint_of(state, up))
        state.cruising_speed_m_s = -1.0

    def on_active(self) -> None:
        """Every cycle in VTOL_TAKEOFF."""
        target = self._target
        if target is None or not self._reached.update(self._state, target):
            return
        if target.command == TAKEOFF:
            self._turn(target)
        else:
            self._ask_for_transition(target)

    def _begin(self, target: Target) -> None:
        self._target = target
        self._reached.restart(self._state.now_us)

    def _turn(self, up: Target) -> None:
        state, triplet, yaw_rad = self._state, self._state.triplet, self._direction_rad
        if not math.isfinite(yaw_rad) and all(map(math.isfinite, self._place_deg)):
            yaw_rad = bearing_rad(up.lat_deg, up.lon_deg, *self._place_deg)
        turned = up._replace(command=WAYPOINT, yaw_rad=wrap_pi(yaw_rad), force_heading=True)
        self._begin(turned)
        current = setpoint_of(state, turned)._replace(cruising_speed=-1.0)
        state.fly(current, previous=triplet.previous, following=triplet.next)

    def _ask_for_transition(self, turned: Target) -> None:
        """PX4 writes only two parameters of its item; the others are what it was before (mission_item_s)."""
        state, triplet = self._state, self._state.triplet
        self._target = None
        state.fly(triplet.current, previous=triplet.current, following=triplet.next)
        was = turned.loiter_radius_m, turned.yaw_rad, 0.0, 0.0, turned.alt_m
        state.tell(VehicleCommand(mavlink.MAV_CMD_DO_VTOL_TRANSITION, FIXED_WING, 0.0, *was))
