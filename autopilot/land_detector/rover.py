"""Whether a rover is landed: PX4's RoverLandDetector (src/modules/land_detector, v1.18).

It is in the air, as PX4 sees it, once it was armed for half a second; in a return, armed or not, it is so but within
NAV_ACC_RAD of its home; it is landed whenever it is told to land.
"""

from typing import Final

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.land_detector.held import Held
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core.geodesy import distance_m

IN_AIR_S: Final = 0.5
"""RoverLandDetector: set_hysteresis_time_from(true, 500_ms)."""


class RoverLandDetector:
    """What does not leave the ground."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._in_air = Held(False)

    def update(self, now_us: int) -> tuple[bool, ...]:
        """landed, maybe_landed, ground_contact, freefall and in_ground_effect; it never leaves the ground."""
        landed = not self._in_air.update(now_us, not self._is_down(), IN_AIR_S)
        return landed, False, True, False, False

    def details(self, now_us: int) -> tuple[bool, ...]:
        """It tells no more than that."""
        return ()

    def _is_down(self) -> bool:
        topics = self._topics
        nav_state = topics.vehicle_status.nav_state
        if nav_state in (NavState.AUTO_LAND, NavState.DESCEND):
            return True
        if nav_state == NavState.AUTO_RTL:
            triplet, place = topics.position_setpoint_triplet, topics.vehicle_global_position
            target = triplet.current
            if not target.valid or not place.valid or triplet.next.valid:
                return False
            return distance_m(place.lat, place.lon, target.lat, target.lon) < self._parameters["NAV_ACC_RAD"]
        return not topics.actuator_armed.armed
