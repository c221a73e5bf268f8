"""Canopy and crop as rays meet them: leaves fill cells of the ground's plan, the others are gaps.

A cell has leaves from a cover's `base_m` to its `height_m` over the ground, or none at all: which of the two, its place
tells by a hash (`marching.leaves`), so that as many cells have leaves as the cover's density says. Nothing sways, and
nobody collides.
"""

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from sitl_emu.world import marching, polygons
from sitl_emu.world.description import Cover
from sitl_emu.world.ground import Terrain
from sitl_emu.world.terrain import HeightMap

FloatArray = npt.NDArray[np.float64]

CELL_M = 0.5
"""Ours: the size of a twig with its leaves, and so of a gap."""
STEP_M = 0.2
BISECTIONS = 12
"""A step, halved so often, is shorter than a tenth of a millimetre."""


def meet(cover: Cover, terrain: Terrain, origins: FloatArray, directions: FloatArray, reach: FloatArray) -> FloatArray:
    """Ranges (n,) at which rays (n, 3; NED) first meet leaves within their `reach` (n,); inf where they meet none."""
    start, end = _within(_box(cover, terrain), origins, directions)
    end = np.minimum(end, reach)
    return marching.run(
        marching.leaves, origins, directions, start, end, STEP_M, BISECTIONS, float(cover.base_m),
        float(cover.height_m), cover.density * 2.0**32, CELL_M, _sides(cover.polygon_m), marching.grid_of(terrain),
    )  # fmt: skip


@cache
def _sides(polygon: tuple[polygons.Corner, ...]) -> FloatArray:
    return np.array([(*one, *other) for one, other in polygons.edges(polygon)])


def _box(cover: Cover, terrain: Terrain) -> tuple[FloatArray, FloatArray]:
    """The cuboid (NED) that holds all its leaves."""
    corners = np.array(cover.polygon_m)
    (south, west), (north, east) = corners.min(axis=0), corners.max(axis=0)
    lowest = highest = terrain.height_m(south, west)
    if isinstance(terrain, HeightMap):
        lowest, highest = terrain.extremes_m(south, west, north, east)
    low = np.array((south, west, -highest - cover.height_m))
    return low, np.array((north, east, -lowest - cover.base_m))


def _within(
    box: tuple[FloatArray, FloatArray], origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """From where to where (m along) rays are in a box; start > end where they never are."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        one, other = (box[0] - origins) / directions, (box[1] - origins) / directions
    # a ray along a side: 0 / 0; it is in between, or never
    along = directions == 0.0
    between = (origins >= box[0]) & (origins <= box[1])
    near = np.where(along, np.where(between, -math.inf, math.inf), np.minimum(one, other))
    far = np.where(along, np.where(between, math.inf, -math.inf), np.maximum(one, other))
    return np.maximum(near.max(axis=1), 0.0), far.min(axis=1)
