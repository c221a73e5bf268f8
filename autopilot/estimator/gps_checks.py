"""May the filter use the GPS? PX4's EKF2_REQ_* checks (gps_checks.cpp, v1.18; EKF2_GPS_CHECK picks them).

Checked are fix type, satellites and the two position accuracies, for EKF2_REQ_GPS_H seconds without a break. Drift and
speed at rest (EKF2_REQ_HDRIFT, _VDRIFT), speed accuracy (_SACC), PDOP, and spoofing are left out: HIL_GPS carries no
speed accuracy, and simulated receivers neither drift away nor lie.
"""

from autopilot.parameters import Parameters
from autopilot.topics import SensorGps

CHECK_SATELLITES, CHECK_EPH, CHECK_EPV, CHECK_FIX = 1 << 0, 1 << 2, 1 << 3, 1 << 10
LEAST_FIX = 3


class GpsChecks:
    """`passed`: the checks have held for long enough."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._good_since_us: int | None = None
        self.passed = False

    def update(self, now_us: int, gps: SensorGps) -> None:
        """A new fix came in."""
        if not self._good(gps):
            self._good_since_us, self.passed = None, False
            return
        if self._good_since_us is None:
            self._good_since_us = now_us
        self.passed = now_us - self._good_since_us >= self._parameters["EKF2_REQ_GPS_H"] * 1e6

    def lost(self) -> None:
        """Nothing came for too long."""
        self._good_since_us, self.passed = None, False

    def _good(self, gps: SensorGps) -> bool:
        parameters = self._parameters
        checks = int(parameters["EKF2_GPS_CHECK"])
        failed = (
            (gps.fix_type < LEAST_FIX)
            or (checks & CHECK_FIX and gps.fix_type < parameters["EKF2_REQ_FIX"])
            or (checks & CHECK_SATELLITES and gps.satellites_used < parameters["EKF2_REQ_NSATS"])
            or (checks & CHECK_EPH and gps.eph > parameters["EKF2_REQ_EPH"])
            or (checks & CHECK_EPV and gps.epv > parameters["EKF2_REQ_EPV"])
        )
        return not failed
