"""Canopy and crop as rays meet them: leaves fill cells of the ground's plan, the others are gaps.

A cell has leaves from a cover's `base_m` to its `height_m` over the ground, or none at all: which of the two, its place
tells by a hash (`marching.leaves`), so that as many cells have leaves as the cover's density says. Nothing sways, and
nobody collides.
"""

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from sitl_emu.vehicles.dynamics import Vector3
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


Box = tuple[Vector3, Vector3]
"""Its least and its greatest corner, NED."""


def meet(
    cover: Cover, box: Box, terrain: Terrain, origins: FloatArray, directions: FloatArray, reach: FloatArray
) -> FloatArray:
    """Ranges (n,) at which rays (n, 3; NED) first meet leaves within their `reach` (n,); inf where they meet none.

    `box`: that of the cover (`box_of`).
    """
    start, end = _within(np.array(box), origins, directions)
    end = np.minimum(end, reach)
    return marching.run(
        marching.leaves, origins, directions, start, end, STEP_M, BISECTIONS, float(cover.base_m),
        float(cover.height_m), cover.density * 2.0**32, CELL_M, _sides(cover.polygon_m), marching.grid_of(terrain),
    )  # fmt: skip


@cache
def _sides(polygon: tuple[polygons.Corner, ...]) -> FloatArray:
    return np.array([(*one, *other) for one, other in polygons.edges(polygon)])


def box_of(cover: Cover, terrain: Terrain) -> Box:
    """The cuboid that holds all its leaves."""
    south, west = map(min, zip(*cover.polygon_m, strict=True))
    north, east = map(max, zip(*cover.polygon_m, strict=True))
    lowest = highest = terrain.height_m(south, west)
    if isinstance(terrain, HeightMap):
        lowest, highest = terrain.extremes_m(south, west, north, east)
    return (south, west, -highest - cover.height_m), (north, east, -lowest - cover.base_m)


def may_meet(box: Box, origin: Vector3, direction: Vector3, reach_m: float) -> bool:
    """Whether a beam comes into a box; `meet` takes ten times as long to find that it does not.

    `origin` in metres, `direction` of length one, both NED.
    """
    near, far = 0.0, reach_m
    for low, high, at, along in zip(*box, origin, direction, strict=True):
        if along == 0.0:
            if not low <= at <= high:
                return False
            continue
        one, other = (low - at) / along, (high - at) / along
        near, far = max(near, min(one, other)), min(far, max(one, other))
    return near <= far


def _within(box: FloatArray, origins: FloatArray, directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From where to where (m along) rays are in a box; start > end where they never are."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        one, other = (box[0] - origins) / directions, (box[1] - origins) / directions
    # a ray along a side: 0 / 0; it is in between, or never
    along = directions == 0.0
    between = (origins >= box[0]) & (origins <= box[1])
    near = np.where(along, np.where(between, -math.inf, math.inf), np.minimum(one, other))
    far = np.where(along, np.where(between, math.inf, -math.inf), np.maximum(one, other))
    return np.maximum(near.max(axis=1), 0.0), far.min(axis=1)
