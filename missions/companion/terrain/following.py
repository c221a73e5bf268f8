"""Flying over ground that is mapped: at a height over it, and clear in time of what lies in a corridor ahead.

Altitudes and heights count upwards from the map's origin. A height counts with some sigmas added: the ground is hardly
higher than that. What is not mapped asks for nothing.
"""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.terrain.terrain_map import Grid, TerrainMap

SLOWEST_M_S = 0.1
"""So that what hovers is not told that it never arrives."""


class Following(NamedTuple):
    """How to follow the ground; all ours."""

    clearance_m: float = 10.0
    sigmas: float = 2.0
    ahead_m: float = 40.0
    """At 5 m/s and 2 m/s of climb, enough for a wall of 16 m."""
    half_width_m: float = 4.0
    """To either side of the way, behind, and beyond its end: for the vehicle's size and its place's error."""
    climb_m_s: float = 2.0
    sink_m_s: float = 1.0


class Altitude(NamedTuple):
    """What to fly next."""

    altitude_m: float
    wanted_m: float
    """What is held, or clears all that is mapped ahead if one climbs on from there; NaN where neither is known."""
    late_m: float
    """How far below that it lies, as no faster climb is to be had; 0: in time. To slow down, or stop, makes it less."""


def next_altitude(
    terrain: TerrainMap,
    here_m: Corner,
    course_rad: float,
    speed_m_s: float,
    altitude_m: float,
    dt_s: float,
    following: Following,
    hold_m: float = math.nan,
) -> Altitude:
    """The altitude to be at after `dt_s`, from `altitude_m` now: as low as clears the ground, by its rates.

    Each cell of the corridor asks for its height with the clearance when it comes within `half_width_m`, and until then
    for as much less as can be climbed on the way. `hold_m`: what to fly where no cell asks for more; NaN: not known.
    Where neither is known, the altitude stays.
    """
    heights, distances = _corridor(terrain, here_m, course_rad, following)
    left_s = np.maximum(distances - following.half_width_m, 0.0) / max(speed_m_s, SLOWEST_M_S)
    asked = heights + following.clearance_m - following.climb_m_s * left_s
    wanted = float(np.fmax.reduce(asked, initial=hold_m))
    if math.isnan(wanted):
        return Altitude(altitude_m, math.nan, 0.0)
    highest, lowest = altitude_m + following.climb_m_s * dt_s, altitude_m - following.sink_m_s * dt_s
    return Altitude(min(max(wanted, lowest), highest), wanted, max(0.0, wanted - highest))


def _corridor(terrain: TerrainMap, here_m: Corner, course_rad: float, following: Following) -> tuple[Grid, Grid]:
    """Heights (with their sigmas) and distances of the known cells that a corridor touches."""
    c, s = math.cos(course_rad), math.sin(course_rad)
    reach = following.half_width_m + terrain.resolution_m / math.sqrt(2.0)
    ends = [(u * c - v * s, u * s + v * c) for u in (-reach, following.ahead_m + reach) for v in (-reach, reach)]
    north, east = zip(*((here_m[0] + n, here_m[1] + e) for n, e in ends), strict=True)
    row, column = (int(at) for at in terrain.cell(min(north), min(east)))
    last_row, last_column = (int(at) for at in terrain.cell(max(north), max(east)))
    means, sigmas = terrain.part(row, column, last_row - row + 1, last_column - column + 1)
    rows, columns = np.mgrid[row : last_row + 1, column : last_column + 1]
    n = terrain.south_m + (rows + 0.5) * terrain.resolution_m - here_m[0]
    e = terrain.west_m + (columns + 0.5) * terrain.resolution_m - here_m[1]
    along, across = n * c + e * s, e * c - n * s
    inside = (along >= -reach) & (along <= following.ahead_m + reach) & (np.abs(across) <= reach)
    known = inside & np.isfinite(means)
    # a cell's near edge comes first
    nearest = np.maximum(along[known] - terrain.resolution_m / math.sqrt(2.0), 0.0)
    return (means + following.sigmas * sigmas)[known], nearest
