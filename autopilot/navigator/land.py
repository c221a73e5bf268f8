"""LAND: come to rest and descend there. PX4's Land (src/modules/navigator/land.cpp, v1.18).

Where nothing is known of the Earth, the setpoint has no place; its altitude is that of the sea (set_land_item).
A rover counts as landed at once, and its control does not look at the setpoint: it drives on to the target that it had.
"""

import math

from sitl_emu.autopilot.constants import SetpointType
from sitl_emu.autopilot.navigator.state import NavigatorState


class Land:
    """AUTO_LAND, and the other modes that land where the vehicle is."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state

    def on_activation(self) -> None:
        """Enter LAND."""
        state = self._state
        state.mission_finished = False
        state.tell_mission()
        lat, lon = state.stop_point() if state.topics.vehicle_local_position.xy_global else (math.nan, math.nan)
        radius_m = state.acceptance_radius_m()
        state.fly(state.setpoint(SetpointType.LAND, lat, lon, 0.0, acceptance_radius_m=radius_m))
        state.cruising_speed_m_s = -1.0
        state.centre_gimbal()

    def on_active(self) -> None:
        """Every cycle in LAND."""
        state = self._state
        if state.landed:
            state.finished = state.mission_finished = True
            state.tell_mission()
