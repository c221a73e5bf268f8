"""Where a fire of a world burns at a time, where it has burnt out, and how its smoke drifts: pure functions.

A front moves evenly to where the mean wind of time 0 blows: what it has reached is the polygon, swept along that way.
Each place burns for `burns_s`. That is all: fuel, slope and later changes of the wind do not count. (Rothermel's rate
of spread, from which a world's author may take `spread_m_s`, holds for one fuel, slope and wind as well: USDA INT-115,
1972.)
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world import polygons
from sitl_emu.world.description import Fire, Wind
from sitl_emu.world.wind import mean_at

FloatArray = npt.NDArray[np.float64]
Polygon = tuple[tuple[float, float], ...]
WIDENS = 0.12
"""Radius of a buoyant plume per metre of height: 6/5 of the entrainment coefficient 0.1 (Morton, Taylor and Turner,
Turbulent gravitational convection from maintained and instantaneous sources, 1956)."""


class Plume(NamedTuple):
    """Smoke at a height: its cross-section is the fire's outline, moved and grown."""

    north_m: float
    east_m: float
    """Whereto it has drifted from the fire."""
    widening_m: float
    extinction_1_m: float


def reached(fire: Fire, wind: Wind, time_s: float) -> Polygon:
    """What burns or has burnt at a time."""
    return _swept(fire, wind, time_s)


def burnt(fire: Fire, wind: Wind, time_s: float) -> Polygon:
    """What has burnt out at a time; empty: nothing yet."""
    if not fire.burns_s or time_s < fire.burns_s:
        return ()
    return _swept(fire, wind, time_s - fire.burns_s)


def burns(fire: Fire, wind: Wind, time_s: float, north: FloatArray, east: FloatArray) -> npt.NDArray[np.bool_]:
    """At which of many places (arrays of one shape) there are flames."""
    out = burnt(fire, wind, time_s)
    return polygons.inside(reached(fire, wind, time_s), north, east) & ~polygons.inside(out, north, east)


def plume(fire: Fire, wind: Wind, time_s: float, height_m: float) -> Plume:
    """Its smoke at a height over ground, that of the moment's mean wind. Raises ValueError for a fire without smoke."""
    if fire.smoke is None:
        raise ValueError(f"{fire.name} has no smoke")
    changes = ((0.0, wind.north_m_s, wind.east_m_s), *((c.at_s, c.north_m_s, c.east_m_s) for c in wind.changes))
    north_m_s, east_m_s = mean_at(changes, time_s)
    rises_s, widening = height_m / fire.smoke.rise_m_s, WIDENS * height_m
    radius = math.sqrt(abs(polygons.area_m2(fire.polygon_m)) / math.pi)
    thinned = (radius / (radius + widening)) ** 2
    density = fire.smoke.density_1_m * thinned if height_m <= fire.smoke.height_m else 0.0
    return Plume(rises_s * north_m_s, rises_s * east_m_s, widening, density)


def front_m_s(fire: Fire, wind: Wind) -> tuple[float, float]:
    """How fast its front moves, north and east: with the mean wind of time 0; in calm air it stays."""
    speed = math.hypot(wind.north_m_s, wind.east_m_s)
    if speed == 0.0:
        return 0.0, 0.0
    return fire.spread_m_s * wind.north_m_s / speed, fire.spread_m_s * wind.east_m_s / speed


def _swept(fire: Fire, wind: Wind, time_s: float) -> Polygon:
    north_m_s, east_m_s = front_m_s(fire, wind)
    if time_s <= 0.0 or (north_m_s, east_m_s) == (0.0, 0.0):
        return fire.polygon_m
    there = polygons.moved(fire.polygon_m, time_s * north_m_s, time_s * east_m_s)
    return polygons.hull((*fire.polygon_m, *there))
