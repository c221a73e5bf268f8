"""The Earth's magnetic field at a place: what a magnetometer measures and where compass north is.

World Magnetic Model 2020 (NOAA NCEI and British Geological Survey, public domain): spherical harmonics up to degree 12
with their secular variation, at sea level, for the date of PX4 v1.18's lookup tables (src/lib/world_magnetic_model).
Like them it is worked out every ten degrees and interpolated in between: so world and estimator look for north where a
real PX4 does, up to half a degree beside where it is. Altitude and the Earth's crust are left out.
"""

import functools
import math
from typing import NamedTuple

Coefficients = tuple[tuple[tuple[float, float], ...], ...]
GAUSS: Coefficients = (
    ((-29404.5, 0.0), (-1450.7, 4652.9)),
    ((-2500.0, 0.0), (2982.0, -2991.6), (1676.8, -734.8)),
    ((1363.9, 0.0), (-2381.0, -82.2), (1236.2, 241.8), (525.7, -542.9)),
    ((903.1, 0.0), (809.4, 282.0), (86.2, -158.4), (-309.4, 199.8), (47.9, -350.1)),
    ((-234.4, 0.0), (363.1, 47.7), (187.8, 208.4), (-140.7, -121.3), (-151.2, 32.2), (13.7, 99.1)),
    ((65.9, 0.0), (65.6, -19.1), (73.0, 25.0), (-121.5, 52.7), (-36.2, -64.4), (13.5, 9.0), (-64.7, 68.1)),
    ((80.6, 0.0), (-76.8, -51.4), (-8.3, -16.8), (56.5, 2.3), (15.8, 23.5), (6.4, -2.2), (-7.2, -27.2), (9.8, -1.9)),
    (
        (23.6, 0.0), (9.8, 8.4), (-17.5, -15.3), (-0.4, 12.8), (-21.1, -11.8), (15.3, 14.9), (13.7, 3.6),
        (-16.5, -6.9), (-0.3, 2.8),
    ),
    (
        (5.0, 0.0), (8.2, -23.3), (2.9, 11.1), (-1.4, 9.8), (-1.1, -5.1), (-13.3, -6.2), (1.1, 7.8), (8.9, 0.4),
        (-9.3, -1.5), (-11.9, 9.7),
    ),
    (
        (-1.9, 0.0), (-6.2, 3.4), (-0.1, -0.2), (1.7, 3.5), (-0.9, 4.8), (0.6, -8.6), (-0.9, -0.1), (1.9, -4.2),
        (1.4, -3.4), (-2.4, -0.1), (-3.9, -8.8),
    ),
    (
        (3.0, 0.0), (-1.4, -0.0), (-2.5, 2.6), (2.4, -0.5), (-0.9, -0.4), (0.3, 0.6), (-0.7, -0.2), (-0.1, -1.7),
        (1.4, -1.6), (-0.6, -3.0), (0.2, -2.0), (3.1, -2.6),
    ),
    (
        (-2.0, 0.0), (-0.1, -1.2), (0.5, 0.5), (1.3, 1.3), (-1.2, -1.8), (0.7, 0.1), (0.3, 0.7), (0.5, -0.1),
        (-0.2, 0.6), (-0.5, 0.2), (0.1, -0.9), (-1.1, -0.0), (-0.3, 0.5),
    ),
)  # fmt: skip
"""(g, h) in nT of 2020.0 by degree n = 1.. and order m = 0..n, Schmidt semi-normalised."""
SECULAR_VARIATION: Coefficients = (
    ((6.7, 0.0), (7.7, -25.1)),
    ((-11.5, 0.0), (-7.1, -30.2), (-2.2, -23.9)),
    ((2.8, 0.0), (-6.2, 5.7), (3.4, -1.0), (-12.2, 1.1)),
    ((-1.1, 0.0), (-1.6, 0.2), (-6.0, 6.9), (5.4, 3.7), (-5.5, -5.6)),
    ((-0.3, 0.0), (0.6, 0.1), (-0.7, 2.5), (0.1, -0.9), (1.2, 3.0), (1.0, 0.5)),
    ((-0.6, 0.0), (-0.4, 0.1), (0.5, -1.8), (1.4, -1.4), (-1.4, 0.9), (-0.0, 0.1), (0.8, 1.0)),
    ((-0.1, 0.0), (-0.3, 0.5), (-0.1, 0.6), (0.7, -0.7), (0.2, -0.2), (-0.5, -1.2), (-0.8, 0.2), (1.0, 0.3)),
    (
        (-0.1, 0.0), (0.1, -0.3), (-0.1, 0.7), (0.5, -0.2), (-0.1, 0.5), (0.4, -0.3), (0.5, -0.5), (0.0, 0.4),
        (0.4, 0.1),
    ),
    (
        (-0.1, 0.0), (-0.2, -0.3), (-0.0, 0.2), (0.4, -0.4), (-0.3, 0.4), (-0.0, 0.1), (0.3, -0.0), (-0.0, -0.2),
        (-0.0, 0.5), (-0.4, 0.2),
    ),
    (
        (0.0, 0.0), (-0.0, -0.0), (-0.0, 0.1), (0.2, -0.3), (-0.1, 0.1), (-0.2, -0.2), (-0.0, 0.1), (-0.1, -0.0),
        (-0.2, -0.1), (-0.1, 0.2), (-0.0, -0.0),
    ),
    (
        (-0.0, 0.0), (-0.1, -0.0), (-0.0, 0.1), (0.0, 0.0), (-0.0, 0.2), (-0.1, -0.0), (0.0, 0.0), (-0.0, 0.1),
        (-0.1, -0.0), (-0.1, -0.1), (-0.1, 0.0), (-0.1, -0.0),
    ),
    (
        (0.0, 0.0), (-0.0, -0.0), (-0.0, 0.0), (0.0, -0.1), (-0.0, 0.1), (-0.0, -0.0), (0.0, 0.0), (-0.0, -0.0),
        (0.0, 0.1), (-0.0, -0.0), (-0.0, -0.0), (-0.0, 0.0), (-0.1, -0.1),
    ),
)  # fmt: skip
"""Their change, nT a year."""
YEARS_SINCE_EPOCH = 2024.41257 - 2020.0
"""Of PX4's tables."""
GRID_DEG = 10
STEPS = (math.radians(0.00545143529), math.radians(0.00269892697), 2.04183477e-5)
"""Of the tables' numbers: declination, inclination (PX4's are 16 bits, scaled by the largest), strength (gauss)."""
MEAN_RADIUS_KM, EQUATOR_KM, POLE_KM = 6371.2, 6378.137, 6356.7523142
"""Of the geomagnetic reference sphere and of WGS 84."""


class MagneticField(NamedTuple):
    """Declination (east positive) and inclination (down positive) in radians, strength in gauss."""

    declination_rad: float
    inclination_rad: float
    strength_gauss: float


@functools.lru_cache(maxsize=64)
def magnetic_field(lat_deg: float, lon_deg: float) -> MagneticField:
    """The field at sea level, interpolated on the grid. Any finite longitude is taken; latitudes end at the poles."""
    lat_deg = max(-90.0, min(90.0, lat_deg))
    lon_deg = math.remainder(lon_deg, 360.0)
    south = min(math.floor(lat_deg / GRID_DEG) * GRID_DEG, 90 - GRID_DEG)
    west = min(math.floor(lon_deg / GRID_DEG) * GRID_DEG, 180 - GRID_DEG)
    north_share, east_share = (lat_deg - south) / GRID_DEG, (lon_deg - west) / GRID_DEG
    corners = [modelled_field(south + dy, west + dx) for dy in (0, GRID_DEG) for dx in (0, GRID_DEG)]
    values = []
    for step, *corner in zip(STEPS, *corners, strict=True):
        sw, se, nw, ne = (step * round(value / step) for value in corner)
        low, high = sw + east_share * (se - sw), nw + east_share * (ne - nw)
        values.append(low + north_share * (high - low))
    return MagneticField(*values)


@functools.lru_cache(maxsize=64)
def modelled_field(lat_deg: float, lon_deg: float) -> MagneticField:
    """The model's own field at sea level."""
    lat, lon = math.radians(lat_deg), math.radians(lon_deg)
    across, along, turn = _geocentric(lat)
    cos_t, sin_t = along, max(across, 1e-6)
    legendre, slopes = _schmidt(len(GAUSS), cos_t, sin_t)
    ratio = MEAN_RADIUS_KM / _radius_km(lat)
    radial = south = east = 0.0
    for n, (row, changes) in enumerate(zip(GAUSS, SECULAR_VARIATION, strict=True), start=1):
        scale = ratio ** (n + 2)
        for m, ((g, h), (dg, dh)) in enumerate(zip(row, changes, strict=True)):
            g, h = g + dg * YEARS_SINCE_EPOCH, h + dh * YEARS_SINCE_EPOCH
            c, s = math.cos(m * lon), math.sin(m * lon)
            radial += scale * (n + 1) * (g * c + h * s) * legendre[n][m]
            south -= scale * (g * c + h * s) * slopes[n][m]
            east += scale * m * (g * s - h * c) * legendre[n][m] / sin_t
    # From the sphere's vertical to that of the ellipsoid.
    north, down = -south, -radial
    north, down = north * math.cos(turn) - down * math.sin(turn), north * math.sin(turn) + down * math.cos(turn)
    horizontal = math.hypot(north, east)
    return MagneticField(
        math.atan2(east, north), math.atan2(down, horizontal), math.hypot(horizontal, down) * 1e-5
    )  # nT to gauss


def _radius_km(latitude: float) -> float:
    """Distance from the Earth's centre of a place at sea level."""
    x, z = _meridian(latitude)
    return math.hypot(x, z)


def _meridian(latitude: float) -> tuple[float, float]:
    """Distance (km) from the axis and from the equator's plane."""
    flat = (POLE_KM / EQUATOR_KM) ** 2
    curvature = EQUATOR_KM / math.sqrt(math.cos(latitude) ** 2 + flat * math.sin(latitude) ** 2)
    return curvature * math.cos(latitude), flat * curvature * math.sin(latitude)


def _geocentric(latitude: float) -> tuple[float, float, float]:
    """Cosine and sine of the geocentric latitude, and by how much it exceeds the geodetic one."""
    x, z = _meridian(latitude)
    radius = math.hypot(x, z)
    return x / radius, z / radius, math.atan2(z, x) - latitude


def _schmidt(degree: int, cos_t: float, sin_t: float) -> tuple[list[list[float]], list[list[float]]]:
    """Schmidt semi-normalised associated Legendre functions of cos θ, and their derivatives by θ."""
    p = [[0.0] * (n + 1) for n in range(degree + 1)]
    d = [[0.0] * (n + 1) for n in range(degree + 1)]
    p[0][0] = 1.0
    for n in range(1, degree + 1):
        k = 1.0 if n == 1 else math.sqrt(1.0 - 0.5 / n)
        p[n][n] = k * sin_t * p[n - 1][n - 1]
        d[n][n] = k * (sin_t * d[n - 1][n - 1] + cos_t * p[n - 1][n - 1])
        for m in range(n):
            scale = 1.0 / math.sqrt(n * n - m * m)
            before, slope = (p[n - 2][m], d[n - 2][m]) if m <= n - 2 else (0.0, 0.0)
            back = math.sqrt((n - 1) ** 2 - m * m)
            p[n][m] = scale * ((2 * n - 1) * cos_t * p[n - 1][m] - back * before)
            d[n][m] = scale * ((2 * n - 1) * (cos_t * d[n - 1][m] - sin_t * p[n - 1][m]) - back * slope)
    return p, d
