"""Heading from the magnetometer: PX4's EKF2, aid_sources/magnetometer (v1.18), of which only the heading is fused."""

import math

from autopilot.estimator.filter import HEADING_RATIO, SENSOR_TIMEOUT_US, Filter
from autopilot.topics import Topics
from sitl_emu.core.geodesy import wrap_pi
from sitl_emu.core.geomagnetism import magnetic_field

FUSION_SOURCE = 6
MAG_TYPE_NONE = 5
DECLINATION_BY_PLACE = 1
"""Bit of EKF2_DECL_TYPE; a declination in EKF2_MAG_DECL (PX4 saves one there) goes before."""
LEAST_HORIZONTAL_FIELD_GA = 0.02


def turn_by_declination(kalman: Filter, latitude_deg: float, longitude_deg: float) -> None:
    """The place is known now, and so may be where magnetic north is: the heading turns by that."""
    settings = kalman.settings
    if settings["EKF2_MAG_DECL"] == 0.0 and int(settings["EKF2_DECL_TYPE"]) & DECLINATION_BY_PLACE:
        field = magnetic_field(latitude_deg, longitude_deg)
        kalman.reset_yaw(field.declination_rad - kalman.declination_rad)
        kalman.declination_rad = field.declination_rad


class MagnetometerAid:
    """`fused`: the last sample was, not long ago."""

    def __init__(self, topics: Topics, kalman: Filter) -> None:
        self._topics, self._filter = topics, kalman
        self.sample_us = 0
        self.fused = False

    def update(self, now_us: int, *, other_heading: bool) -> None:
        """Fuse what is new; `other_heading`: somebody else gives the heading."""
        mag, kalman = self._topics.sensor_mag, self._filter
        settings = kalman.settings
        if mag.timestamp == self.sample_us:
            self.fused = self.fused and now_us - self.sample_us < SENSOR_TIMEOUT_US
            return
        self.sample_us = mag.timestamp
        if int(settings["EKF2_MAG_TYPE"]) == MAG_TYPE_NONE or FUSION_SOURCE in kalman.disabled:
            self.fused = False
            return
        x, y, z = mag.magnetometer_ga
        r00, r01, r02, r10, r11, r12, _, _, _ = kalman.state.rotation
        north = r00 * x + r01 * y + r02 * z
        east = r10 * x + r11 * y + r12 * z
        horizontal = math.hypot(north, east)
        if not horizontal > LEAST_HORIZONTAL_FIELD_GA:
            return
        innovation = wrap_pi(kalman.declination_rad - math.atan2(east, north))
        if not kalman.yaw_aligned:
            kalman.reset_yaw(innovation)
            return
        if other_heading:
            return
        variance = (settings["EKF2_MAG_NOISE"] / horizontal) ** 2
        self.fused = kalman.gated(HEADING_RATIO, ((2, innovation, variance),), settings["EKF2_HDG_GATE"], "heading")
