"""Rays against the terrain, many at once."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world import marching
from sitl_emu.world.description import GROUND as GROUND
from sitl_emu.world.ground import FlatGround, Terrain

FloatArray = npt.NDArray[np.float64]

MARCH_STEPS = 400
BISECTIONS = 30
SLOPE_REACH_M = 0.25


class Hits(NamedTuple):
    """What n rays met."""

    range_m: FloatArray
    """(n,); inf where nothing was met."""
    name: list[str]
    """Of what was met: GROUND, a solid's, thing's, area's or vehicle's name; empty for nothing."""
    normal: FloatArray
    """(n, 3), NED, of the surface."""


def meet_terrain(terrain: Terrain, origins: FloatArray, directions: FloatArray, reach_m: float) -> FloatArray:
    """Ranges at which rays first pass below the ground, to a millimetre; inf where they do not within `reach_m`."""
    if isinstance(terrain, FlatGround):
        height = terrain.height_m(0.0, 0.0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            ranges = (-height - origins[:, 2]) / directions[:, 2]
        return np.where((ranges >= 0.0) & (ranges <= reach_m), ranges, np.inf)
    step_m, grid = reach_m / MARCH_STEPS, marching.grid_of(terrain)
    return marching.run(marching.ground, origins, directions, step_m, MARCH_STEPS, BISECTIONS, grid)


def meet_spheres(
    centres: FloatArray, radii: FloatArray, origins: FloatArray, directions: FloatArray, reach_m: float
) -> tuple[FloatArray, FloatArray]:
    """Ranges (n,) at which rays enter the first of k spheres (k, 3; NED, m), inf where none, and normals (n, 3).

    A sphere that a ray begins in is not met: nothing looks at what it is part of.
    """
    ranges, normals = np.full(len(origins), np.inf), np.zeros((len(origins), 3))
    for centre, radius in zip(centres, radii, strict=True):
        away = centre - origins
        along = np.einsum("ij,ij->i", away, directions)
        inside = radius**2 - (np.einsum("ij,ij->i", away, away) - along**2)
        entered = along - np.sqrt(np.maximum(inside, 0.0))
        nearer = (inside >= 0.0) & (entered >= 0.0) & (entered <= reach_m) & (entered < ranges)
        ranges[nearer] = entered[nearer]
        normals[nearer] = (entered[nearer, None] * directions[nearer] - away[nearer]) / radius
    return ranges, normals


def over_terrain(terrain: Terrain, one: FloatArray, other: FloatArray) -> bool:
    """Whether the straight way between two places (NED, m) is above the ground, looked at `MARCH_STEPS` times."""
    at = one + np.linspace(0.0, 1.0, MARCH_STEPS + 1)[:, None] * (other - one)
    return bool(np.all(-at[:, 2] >= heights(terrain, at[:, 0], at[:, 1])))


def terrain_normals(terrain: Terrain, origins: FloatArray, directions: FloatArray, ranges: FloatArray) -> FloatArray:
    """(n, 3), NED: of the ground where rays meet it; upwards where they do not."""
    normals = np.tile((0.0, 0.0, -1.0), (len(ranges), 1))
    met = np.isfinite(ranges)
    if isinstance(terrain, FlatGround) or not met.any():
        return normals
    north, east = (origins[met] + ranges[met, None] * directions[met])[:, :2].T
    reach = SLOPE_REACH_M
    rise_n = heights(terrain, north + reach, east) - heights(terrain, north - reach, east)
    rise_e = heights(terrain, north, east + reach) - heights(terrain, north, east - reach)
    up = np.stack((-rise_n / (2 * reach), -rise_e / (2 * reach), -np.ones(len(north))), axis=1)
    normals[met] = up / np.linalg.norm(up, axis=1)[:, None]
    return normals


def heights(terrain: Terrain, north: FloatArray, east: FloatArray) -> FloatArray:
    """Of many points (arrays of one shape)."""
    many = getattr(terrain, "heights_m", None)
    if many is not None:
        found: FloatArray = many(north, east)
        return found
    return np.full(north.shape, terrain.height_m(0.0, 0.0))
