"""The International Standard Atmosphere below 11 km, and gravity by latitude.

ISO 2533: T = 288.15 K - 6.5 K/km · h, p = 1013.25 hPa (T/T₀)^5.2559 (PX4: src/lib/atmosphere). Gravity: Somigliana's
formula on the WGS 84 ellipsoid, at sea level.
"""

import math
from typing import Final

SEA_LEVEL_HPA: Final = 1013.25
SEA_LEVEL_K: Final = 288.15
LAPSE_K_M: Final = 0.0065
EXPONENT: Final = 9.80665 / (LAPSE_K_M * 287.0528)


def pressure_hpa(alt_amsl_m: float) -> float:
    """Static pressure at an altitude (geopotential, m)."""
    return float(SEA_LEVEL_HPA * (1.0 - LAPSE_K_M / SEA_LEVEL_K * alt_amsl_m) ** EXPONENT)


def density_kg_m3(alt_amsl_m: float) -> float:
    """Density of the air at an altitude."""
    kelvin = SEA_LEVEL_K - LAPSE_K_M * alt_amsl_m
    return 100.0 * pressure_hpa(alt_amsl_m) / (287.0528 * kelvin)


def pressure_altitude_m(pressure: float) -> float:
    """Altitude at which the standard atmosphere has this pressure (hPa); the inverse of `pressure_hpa`."""
    return float(SEA_LEVEL_K / LAPSE_K_M * (1.0 - (pressure / SEA_LEVEL_HPA) ** (1.0 / EXPONENT)))


def gravity_m_s2(lat_deg: float) -> float:
    """Gravity at sea level."""
    square = math.sin(math.radians(lat_deg)) ** 2
    return 9.7803253359 * (1.0 + 0.00193185265241 * square) / math.sqrt(1.0 - 0.00669437999014 * square)
