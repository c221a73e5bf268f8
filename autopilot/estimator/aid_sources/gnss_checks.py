"""May the filter use the receiver? PX4's EKF2_REQ_* checks, strict on the ground, loose in flight.

PX4's EKF2 (EKF/aid_sources/gnss/gnss_checks.cpp, v1.18). EKF2_GPS_CHECK picks which of them count; on the ground all
have to hold for EKF2_REQ_GPS_H seconds, and drift and speed are measured while the vehicle is at rest.
"""

import math
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Final

from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.flags import mask
from sitl_emu.autopilot.estimator.samples import GnssSample
from sitl_emu.autopilot.estimator.state import ZERO
from sitl_emu.autopilot.topics import NAN, Vector3
from sitl_emu.core.geodesy import MapProjection

DRIFT_FILTER_S: Final = 10.0
LIMIT_FACTOR: Final = 10.0
IN_AIR_ACCURACY_M: Final = 50.0
IN_AIR_SPEED_ACCURACY_M_S: Final = 10.0
LEAST_HEALTHY_US: Final = 1_000_000


@dataclass(slots=True)
class Failures:
    """In the order of uORB estimator_status.gps_check_fail_flags."""

    fix: bool = False
    nsats: bool = False
    pdop: bool = False
    hacc: bool = False
    vacc: bool = False
    sacc: bool = False
    hdrift: bool = False
    vdrift: bool = False
    hspeed: bool = False
    vspeed: bool = False
    spoofed: bool = False
    jammed: bool = False

    def mask(self) -> int:
        """As one number."""
        return mask(_failures(self))


_failures = attrgetter(*(field.name for field in fields(Failures)))
CHECK_BITS = {
    "nsats": 0, "pdop": 1, "hacc": 2, "vacc": 3, "sacc": 4, "hdrift": 5, "vdrift": 6, "hspeed": 7, "vspeed": 8,
    "spoofed": 9, "fix": 10, "jammed": 11,
}  # fmt: skip
"""Bits of EKF2_GPS_CHECK."""


class GnssChecks:
    """`passed`: the last sample may be used; `initial_passed`: the strict checks have been."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.failures = Failures()
        self.passed = self.initial_passed = False
        self.last_pass_us = self._last_fail_us = 0
        self.drift_horizontal_m_s = self.drift_vertical_m_s = self.speed_horizontal_m_s = NAN
        self._previous: tuple[int, MapProjection, float] | None = None
        self._drift: Vector3 = ZERO
        self._velocity: Vector3 = ZERO

    def reset(self) -> None:
        """The receiver is not used any more."""
        self.passed = False
        self.last_pass_us = self._last_fail_us = 0
        self._reset_drift()

    def run(self, gnss: GnssSample) -> bool:
        """Look at a sample that has come to the horizon."""
        ekf, now_us = self._ekf, self._ekf.time_us
        if not self._last_fail_us:
            self._last_fail_us = now_us
        if not ekf.flags.in_air:
            self.initial_passed = False
        healthy_us = ekf.settings["EKF2_REQ_GPS_H"] * 1e6
        strict = not self.initial_passed
        if not strict:
            healthy_us = max(LEAST_HEALTHY_US, healthy_us / 10.0)
        good = self._initial_checks(gnss) if strict else self._simplified_checks(gnss)
        self.passed = good and ekf.timed_out(self._last_fail_us, healthy_us)
        if not good:
            self._last_fail_us = now_us
        if self.passed:
            self.initial_passed = True
            self.last_pass_us = now_us
        if math.isfinite(gnss.lat + gnss.lon):
            self._previous = (gnss.time_us, MapProjection(gnss.lat, gnss.lon), gnss.alt)
        return self.passed

    def _enabled_failure(self, names: tuple[str, ...]) -> bool:
        enabled = int(self._ekf.settings["EKF2_GPS_CHECK"])
        return any(getattr(self.failures, name) and enabled >> CHECK_BITS[name] & 1 for name in names)

    def _simplified_checks(self, gnss: GnssSample) -> bool:
        failures = self.failures
        failures.fix = gnss.fix_type < 3
        failures.hacc, failures.vacc = gnss.hacc > IN_AIR_ACCURACY_M, gnss.vacc > IN_AIR_ACCURACY_M
        failures.sacc = gnss.sacc > IN_AIR_SPEED_ACCURACY_M_S
        failures.spoofed, failures.jammed = gnss.spoofed, gnss.jammed
        return not self._enabled_failure(("fix", "hacc", "vacc", "sacc", "spoofed", "jammed"))

    def _initial_checks(self, gnss: GnssSample) -> bool:
        failures, value = self.failures, self._ekf.settings
        failures.fix = gnss.fix_type < value["EKF2_REQ_FIX"]
        failures.nsats = gnss.nsats < value["EKF2_REQ_NSATS"]
        failures.pdop = gnss.pdop > value["EKF2_REQ_PDOP"]
        failures.hacc, failures.vacc = gnss.hacc > value["EKF2_REQ_EPH"], gnss.vacc > value["EKF2_REQ_EPV"]
        failures.sacc = gnss.sacc > value["EKF2_REQ_SACC"]
        failures.spoofed, failures.jammed = gnss.spoofed, gnss.jammed
        self._drift_checks(gnss)
        if math.hypot(gnss.vel[0], gnss.vel[1]) > value["EKF2_VEL_LIM"]:
            failures.hspeed = True
        if abs(gnss.vel[2]) > value["EKF2_VEL_LIM"]:
            failures.vspeed = True
        return not self._enabled_failure(tuple(CHECK_BITS))

    def _drift_checks(self, gnss: GnssSample) -> None:
        """Drift and speed at rest; in flight all is well, and whoever moves on the ground keeps what was found."""
        ekf, failures = self._ekf, self.failures
        if ekf.flags.in_air:
            failures.hdrift = failures.vdrift = failures.hspeed = failures.vspeed = False
            self._reset_drift()
            return
        if not ekf.flags.vehicle_at_rest:
            self._reset_drift()
            return
        north, east, down, dt_s = 0.0, 0.0, 0.0, 1e-3
        if self._previous is not None:
            then_us, projection, alt = self._previous
            north, east = projection.project(gnss.lat, gnss.lon)
            down = alt - gnss.alt
            dt_s = min(max((gnss.time_us - then_us) * 1e-6, 1e-3), DRIFT_FILTER_S)
        weight = dt_s / DRIFT_FILTER_S
        h_limit, v_limit = ekf.settings["EKF2_REQ_HDRIFT"], ekf.settings["EKF2_REQ_VDRIFT"]
        n, e, d = self._drift
        self._drift = n, e, d = (
            _limited(n + weight * (north / dt_s - n), h_limit),
            _limited(e + weight * (east / dt_s - e), h_limit),
            _limited(d + weight * (down / dt_s - d), v_limit),
        )
        self.drift_horizontal_m_s, self.drift_vertical_m_s = math.hypot(n, e), abs(d)
        failures.hdrift, failures.vdrift = self.drift_horizontal_m_s > h_limit, self.drift_vertical_m_s > v_limit
        n, e, d = self._velocity
        vn, ve, vd = gnss.vel
        self._velocity = n, e, d = (
            n + weight * (_limited(vn, h_limit) - n),
            e + weight * (_limited(ve, h_limit) - e),
            d + weight * (_limited(vd, v_limit) - d),
        )
        self.speed_horizontal_m_s = math.hypot(n, e)
        failures.hspeed, failures.vspeed = self.speed_horizontal_m_s > h_limit, abs(d) > v_limit

    def _reset_drift(self) -> None:
        self._drift = self._velocity = ZERO
        self.drift_horizontal_m_s = self.drift_vertical_m_s = self.speed_horizontal_m_s = NAN


def _limited(value: float, limit: float) -> float:
    largest = LIMIT_FACTOR * abs(limit)
    return max(-largest, min(largest, value))
