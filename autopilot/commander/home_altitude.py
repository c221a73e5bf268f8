"""Home's height, put right where the receiver's height drifts away from barometer and climb rate in the first minutes.

PX4's HomePosition::update (v1.18), in the 120 s after each takeoff. The barometer's height and the integral of the
receiver's climb rate both begin at the receiver's height. Where these two agree better with each other than either does
with the receiver's height, that has drifted, and the height that home was given with it. (PX4's low-pass of the
barometer takes microseconds for seconds, and smooths nothing.)
"""

import math
from typing import Final

from sitl_emu.autopilot.topics import Topics

WINDOW_US: Final = 120_000_000
LEAST_CORRECTION_M: Final = 1.0


class HomeAltitude:
    """Writes home_position's height."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self.takeoff_us = 0
        """When the vehicle left the ground last; 0: it never has."""
        self._gps_us = 0
        self._climbed_m = math.nan
        """The receiver's height at the beginning, and its climb rate summed up since."""
        self._above_baro_m = 0.0
        self._corrected_m = 0.0
        """What home's height has been lowered by, against the receiver's as it was then."""

    def update(self, now_us: int, *, trusted: bool) -> None:
        """In every cycle; `trusted`: the receiver may give a home, and home is set by itself."""
        topics = self._topics
        gps, baro = topics.sensor_gps, topics.vehicle_air_data
        if gps.timestamp == self._gps_us:
            return
        last_us, self._gps_us = self._gps_us, gps.timestamp
        flies = self.takeoff_us and now_us < self.takeoff_us + WINDOW_US
        if not (trusted and flies and last_us and baro.timestamp):
            self._climbed_m = math.nan
            return
        gps_m = gps.altitude_msl_m
        if not math.isfinite(self._climbed_m):
            self._climbed_m, self._above_baro_m = gps_m, gps_m - baro.baro_alt_meter
        self._climbed_m -= (gps.timestamp - last_us) * 1e-6 * gps.vel_d_m_s
        by_baro_m, by_gps_m = baro.baro_alt_meter + self._above_baro_m, gps_m + self._corrected_m
        apart_m = abs(by_baro_m - self._climbed_m)
        if apart_m < abs(by_baro_m - by_gps_m) and apart_m < abs(self._climbed_m - by_gps_m):
            drift_m = by_baro_m - by_gps_m
            if abs(drift_m) > LEAST_CORRECTION_M:
                self._lower(now_us, drift_m)
                self._corrected_m = by_baro_m - gps_m

    def _lower(self, now_us: int, drift_m: float) -> None:
        home = self._topics.home_position
        self._topics.home_position = home._replace(
            timestamp=now_us,
            alt=home.alt - drift_m,
            z=home.z + drift_m,
            manual_home=False,
            update_count=home.update_count + 1,
        )
