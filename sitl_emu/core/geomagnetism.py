"""The Earth's magnetic field at a place: what a magnetometer measures and where compass north is.

World Magnetic Model 2025 (NOAA NCEI and British Geological Survey, public domain): spherical harmonics of the epoch
2025.0 up to degree 8 of its 12, which leaves about a tenth of a degree of declination. PX4's own table
(src/lib/world_magnetic_model) comes from the same model, so that a real PX4 in our worlds finds north where it looks
for it. Secular variation, altitude and the Earth's crust are left out.
"""

import functools
import math
from typing import NamedTuple

GAUSS: tuple[tuple[tuple[float, float], ...], ...] = (
    ((-29351.8, 0.0), (-1410.8, 4545.4)),
    ((-2556.6, 0.0), (2951.1, -3133.6), (1649.3, -815.1)),
    ((1361.0, 0.0), (-2404.1, -56.6), (1243.8, 237.5), (453.6, -549.5)),
    ((895.0, 0.0), (799.5, 278.6), (55.7, -133.9), (-281.1, 212.0), (12.1, -375.6)),
    ((-233.2, 0.0), (368.9, 45.4), (187.2, 220.2), (-138.7, -122.9), (-142.0, 43.0), (20.9, 106.1)),
    ((64.4, 0.0), (63.8, -18.4), (76.9, 16.8), (-115.7, 48.8), (-40.9, -59.8), (14.9, 10.9), (-60.7, 72.7)),
    (
        (79.5, 0.0), (-77.0, -48.9), (-8.8, -14.4), (59.3, -1.0), (15.8, 23.4), (2.5, -7.4), (-11.1, -25.1),
        (14.2, -2.3),
    ),
    (
        (23.2, 0.0), (10.8, 7.1), (-17.5, -12.6), (2.0, 11.4), (-21.7, -9.7), (16.9, 12.7), (15.0, 0.7), (-16.8, -5.2),
        (0.9, 3.9),
    ),
)  # fmt: skip
"""(g, h) in nT by degree n = 1.. and order m = 0..n, Schmidt semi-normalised."""

FLATTENING = 1.0 / 298.257223563


class MagneticField(NamedTuple):
    """Declination (east positive) and inclination (down positive) in radians, strength in gauss."""

    declination_rad: float
    inclination_rad: float
    strength_gauss: float


@functools.lru_cache(maxsize=64)
def magnetic_field(lat_deg: float, lon_deg: float) -> MagneticField:
    """The field at sea level."""
    geocentric = math.atan((1.0 - FLATTENING) ** 2 * math.tan(math.radians(lat_deg)))
    theta, phi = math.pi / 2 - geocentric, math.radians(lon_deg)
    cos_t, sin_t = math.cos(theta), max(math.sin(theta), 1e-6)
    legendre, slopes = _schmidt(len(GAUSS), cos_t, sin_t)
    radial = south = east = 0.0
    for n, row in enumerate(GAUSS, start=1):
        for m, (g, h) in enumerate(row):
            c, s = math.cos(m * phi), math.sin(m * phi)
            radial += (n + 1) * (g * c + h * s) * legendre[n][m]
            south -= (g * c + h * s) * slopes[n][m]
            east += m * (g * s - h * c) * legendre[n][m] / sin_t
    north, down = -south, -radial
    horizontal = math.hypot(north, east)
    return MagneticField(
        math.atan2(east, north), math.atan2(down, horizontal), math.hypot(horizontal, down) * 1e-5
    )  # nT to gauss


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
