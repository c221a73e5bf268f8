"""ALTITUDE_CRUISE: Altitude whose tilt stays when the stick is let go.

Behaves as PX4's FlightTaskAltitudeCruise (v1.18): a full stick takes the tilt from one end to the other in a second.
"""

from typing import ClassVar, Final

from sitl_emu.autopilot.modes.manual_altitude import ManualAltitude
from sitl_emu.autopilot.modes.sticks import Horizontal, within_unit_length
from sitl_emu.autopilot.topics import ManualControlSetpoint

SHARE_A_SECOND: Final = 2.0
"""Of the greatest acceleration, that a full stick adds."""


class AltitudeCruise(ManualAltitude):
    """The flight task of ALTITUDE_CRUISE."""

    NEEDS_STICKS: ClassVar[bool] = False

    def _tilted(self, sticks: ManualControlSetpoint, dt_s: float) -> Horizontal:
        """Forward and to the right, as shares of the greatest acceleration."""
        (forward, right), (more_forward, more_right) = self._tilt, within_unit_length(sticks.pitch, sticks.roll)
        step = SHARE_A_SECOND * dt_s
        self._tilt = within_unit_length(forward + step * more_forward, right + step * more_right)
        return self._tilt
