"""LAND: come to rest and descend there. PX4's Land (src/modules/navigator/land.cpp, v1.18).

A rover counts as landed at once, and its control does not look at the setpoint: it drives on to the target that it had.
"""

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
        state.centre_gimbal()
        lat, lon = state.stop_point()
        state.fly(state.setpoint(SetpointType.LAND, lat, lon, state.position.alt))

    def on_active(self) -> None:
        """Every cycle in LAND."""
        if self._state.landed:
            self._state.finished = self._state.mission_finished = True
