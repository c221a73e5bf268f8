"""GUIDED_COURSE: for a fixed wing, along a course; whatever else flies goes to where it was when it entered the mode.

PX4's Course (src/modules/navigator/course.cpp, v1.18). DO_CHANGE_ALTITUDE sets the height, and the place anew.
"""

import math

from sitl_emu.autopilot.constants import SetpointType, Severity
from sitl_emu.autopilot.navigator.geofence import Geofence
from sitl_emu.autopilot.navigator.state import NavigatorState

ALTITUDE_OUTSIDE = "navigator_course_change_altitude_outside_geofence"


class Course:
    """GUIDED_COURSE."""

    def __init__(self, state: NavigatorState, geofence: Geofence) -> None:
        self._state, self._geofence = state, geofence

    def on_activation(self) -> None:
        """Enter the mode: stay here."""
        self._state.cruising_speed_m_s = -1.0
        self._fly(self._state.position.alt)

    def on_active(self) -> None:
        """Every cycle: nothing changes without a command."""

    def change_altitude(self, altitude_amsl_m: float) -> None:
        """DO_CHANGE_ALTITUDE; NaN keeps the present one. Refused beyond the fence, with PX4's text."""
        state, position = self._state, self._state.position
        altitude_m = altitude_amsl_m if math.isfinite(altitude_amsl_m) else position.alt
        if state.settings.gf_action >= 2 and not self._geofence.allows(position.lat, position.lon, altitude_m):
            state.say(Severity.CRITICAL, "Altitude change is outside geofence\t", ALTITUDE_OUTSIDE)
        else:
            self._fly(altitude_m)

    def _fly(self, altitude_m: float) -> None:
        state, position = self._state, self._state.position
        state.fly(state.setpoint(SetpointType.POSITION, position.lat, position.lon, altitude_m))
