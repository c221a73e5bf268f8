"""The Earth's magnetic field at a place: what a magnetometer measures and where compass north is.

International Geomagnetic Reference Field, 13th generation (Alken et al., 2021, doi:10.1186/s40623-020-01288-x):
spherical harmonics of the epoch 2020.0 up to degree 6, on a sphere. That leaves about half a degree of declination
and 2 % of strength: fair for an autopilot and a simulator that both ask here. PX4 reads a table of the same field.
Secular variation, crust and height are left out.
"""

import functools
import math
from typing import NamedTuple

GAUSS: tuple[tuple[tuple[float, float], ...], ...] = (
    ((-29404.8, 0.0), (-1450.9, 4652.5)),
    ((-2499.6, 0.0), (2982.0, -2991.6), (1677.0, -734.6)),
    ((1363.2, 0.0), (-2381.2, -82.1), (1236.2, 241.9), (525.7, -543.4)),
    ((903.0, 0.0), (809.5, 281.9), (86.3, -158.4), (-309.4, 199.7), (48.0, -349.7)),
    ((-234.3, 0.0), (363.2, 47.7), (187.8, 208.3), (-140.7, -121.2), (-151.2, 32.3), (13.5, 98.9)),
    ((66.0, 0.0), (65.5, -19.1), (72.9, 25.1), (-121.5, 52.8), (-36.2, -64.5), (13.5, 8.9), (-64.7, 68.1)),
)
"""(g, h) in nT by degree n = 1.. and order m = 0..n, Schmidt semi-normalised."""


class MagneticField(NamedTuple):
    """Declination (east positive) and inclination (down positive) in radians, strength in gauss."""

    declination_rad: float
    inclination_rad: float
    strength_gauss: float


@functools.lru_cache(maxsize=64)
def magnetic_field(lat_deg: float, lon_deg: float) -> MagneticField:
    """The field at sea level."""
    theta, phi = math.radians(90.0 - lat_deg), math.radians(lon_deg)
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
