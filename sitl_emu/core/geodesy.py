"""Between latitude/longitude and metres on a tangent plane, as PX4 does it.

PX4's `MapProjection` (src/lib/geo/geo.cpp, v1.18): azimuthal equidistant projection on a sphere of
6 371 000 m. Its rounding is behaviour: missions, homes and fences are placed by it.
"""

import math
from typing import Final

EARTH_RADIUS_M: Final = 6371000.0


class MapProjection:
    """Azimuthal equidistant projection around (lat0_deg, lon0_deg)."""

    __slots__ = ("_cos_lat0", "_lat0", "_lon0", "_sin_lat0", "lat0_deg", "lon0_deg")

    def __init__(self, lat0_deg: float, lon0_deg: float) -> None:
        self.lat0_deg, self.lon0_deg = lat0_deg, lon0_deg
        self._lat0, self._lon0 = math.radians(lat0_deg), math.radians(lon0_deg)
        self._sin_lat0, self._cos_lat0 = math.sin(self._lat0), math.cos(self._lat0)

    def project(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        """(north_m, east_m) of a point; NaN for one that is nowhere."""
        if not math.isfinite(lat_deg + lon_deg):
            return math.nan, math.nan
        lat, lon = math.radians(lat_deg), math.radians(lon_deg)
        sin_lat, cos_lat, cos_d_lon = math.sin(lat), math.cos(lat), math.cos(lon - self._lon0)
        cos_c = self._sin_lat0 * sin_lat + self._cos_lat0 * cos_lat * cos_d_lon
        c = math.acos(max(-1.0, min(1.0, cos_c)))
        k = c / math.sin(c) if abs(c) > 0.0 else 1.0
        north = k * (self._cos_lat0 * sin_lat - self._sin_lat0 * cos_lat * cos_d_lon) * EARTH_RADIUS_M
        east = k * cos_lat * math.sin(lon - self._lon0) * EARTH_RADIUS_M
        return north, east

    def reproject(self, north_m: float, east_m: float) -> tuple[float, float]:
        """(lat_deg, lon_deg) of a point; the inverse of `project`; NaN for one that is infinitely far."""
        x, y = north_m / EARTH_RADIUS_M, east_m / EARTH_RADIUS_M
        c = math.hypot(x, y)
        if not math.isfinite(c):
            return math.nan, math.nan
        if c == 0.0:
            return self.lat0_deg, self.lon0_deg
        sin_c, cos_c = math.sin(c), math.cos(c)
        lat = math.asin(max(-1.0, min(1.0, cos_c * self._sin_lat0 + x * sin_c * self._cos_lat0 / c)))
        lon = self._lon0 + math.atan2(y * sin_c, c * self._cos_lat0 * cos_c - x * self._sin_lat0 * sin_c)
        return math.degrees(lat), math.degrees(lon)


def distance_m(lat1_deg: float, lon1_deg: float, lat2_deg: float, lon2_deg: float) -> float:
    """Great-circle distance (PX4's get_distance_to_next_waypoint)."""
    lat1, lat2 = math.radians(lat1_deg), math.radians(lat2_deg)
    d_lat, d_lon = lat2 - lat1, math.radians(lon2_deg - lon1_deg)
    a = math.sin(d_lat / 2) ** 2 + math.sin(d_lon / 2) ** 2 * math.cos(lat1) * math.cos(lat2)
    return 2.0 * EARTH_RADIUS_M * math.atan2(math.sqrt(max(0.0, a)), math.sqrt(max(0.0, 1.0 - a)))


def bearing_rad(lat1_deg: float, lon1_deg: float, lat2_deg: float, lon2_deg: float) -> float:
    """Initial bearing from the first point to the second, in -π..π from north over east."""
    lat1, lat2 = math.radians(lat1_deg), math.radians(lat2_deg)
    d_lon = math.radians(lon2_deg - lon1_deg)
    y = math.sin(d_lon) * math.cos(lat2)
    x = math.cos(lat1) * math.sin(lat2) - math.sin(lat1) * math.cos(lat2) * math.cos(d_lon)
    return math.atan2(y, x)


def wrap_pi(angle_rad: float) -> float:
    """The same angle from -π to less than π, as PX4's matrix::wrap_pi; NaN for an infinite one.

    Half a turn is one to the left: a vehicle that follows from behind goes that way about from the north of its target.
    """
    wrapped = math.nan if math.isinf(angle_rad) else math.remainder(angle_rad, math.tau)
    return -math.pi if wrapped >= math.pi else wrapped
