"""Between latitude/longitude and metres, for distances of a field.

An equirectangular plane on PX4's sphere of 6 371 000 m: at 47 degrees of latitude it differs from PX4's azimuthal
projection by 4 mm at 200 m from the reference, and by 10 cm at 1 km (it grows with the square of the distance). Not for
long ways or the poles.
"""

import math

EARTH_RADIUS_M = 6371000.0


def to_metres(lat_deg: float, lon_deg: float, lat0_deg: float, lon0_deg: float) -> tuple[float, float]:
    """(north_m, east_m) of a point from the reference (lat0_deg, lon0_deg)."""
    north = math.radians(lat_deg - lat0_deg) * EARTH_RADIUS_M
    east = math.radians(lon_deg - lon0_deg) * EARTH_RADIUS_M * math.cos(math.radians(lat0_deg))
    return north, east


def from_metres(north_m: float, east_m: float, lat0_deg: float, lon0_deg: float) -> tuple[float, float]:
    """(lat_deg, lon_deg) of a point; the inverse of `to_metres`."""
    lat = lat0_deg + math.degrees(north_m / EARTH_RADIUS_M)
    lon = lon0_deg + math.degrees(east_m / (EARTH_RADIUS_M * math.cos(math.radians(lat0_deg))))
    return lat, lon


def distance_m(lat1_deg: float, lon1_deg: float, lat2_deg: float, lon2_deg: float) -> float:
    """Distance of two points."""
    return math.hypot(*to_metres(lat2_deg, lon2_deg, lat1_deg, lon1_deg))
