"""Canopy and crop as rays meet them: leaves fill cells of the ground's plan, the others are gaps.

A cell has leaves from a cover's `base_m` to its `height_m` over the ground, or none at all: which of the two, its place
tells by a hash, so that as many cells have leaves as the cover's density says. Nothing sways, and nobody collides.
"""

import math

import numpy as np
import numpy.typing as npt

from sitl_emu.world import polygons, rays
from sitl_emu.world.description import Cover
from sitl_emu.world.ground import Terrain
from sitl_emu.world.terrain import HeightMap

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

CELL_M = 0.5
"""Ours: the size of a twig with its leaves, and so of a gap."""
STEP_M = 0.2
BISECTIONS = 12
"""A step, halved so often, is shorter than a tenth of a millimetre."""


def leafy(north: FloatArray, east: FloatArray, density: float) -> BoolArray:
    """Whether the cells at these places have leaves (a hash of 32 bits of the cell's two numbers)."""
    row = np.floor(north / CELL_M).astype(np.int64).astype(np.uint32)
    column = np.floor(east / CELL_M).astype(np.int64).astype(np.uint32)
    mixed = (row * np.uint32(0x9E3779B1)) ^ (column * np.uint32(0x85EBCA77))
    mixed = (mixed ^ (mixed >> np.uint32(15))) * np.uint32(0x2C1B3C6D)
    mixed = (mixed ^ (mixed >> np.uint32(12))) * np.uint32(0x297A2D39)
    mixed ^= mixed >> np.uint32(15)
    return np.asarray(mixed < density * 2.0**32)


def meet(cover: Cover, terrain: Terrain, origins: FloatArray, directions: FloatArray, reach: FloatArray) -> FloatArray:
    """Ranges (n,) at which rays (n, 3; NED) first meet leaves within their `reach` (n,); inf where they meet none."""
    start, end = _within(_box(cover, terrain), origins, directions)
    end = np.minimum(end, reach)
    met = np.full(len(origins), np.inf)
    open_ = np.flatnonzero(start <= end)
    step = 0
    while len(open_):
        at = np.minimum(start[open_] + step * STEP_M, end[open_])
        hit = _leaves(cover, terrain, origins[open_] + at[:, None] * directions[open_])
        met[open_[hit]] = at[hit]
        open_ = open_[~hit & (at < end[open_])]
        step += 1
    found = np.flatnonzero(np.isfinite(met))
    if not len(found):  # as most often, of a single beam: twelve halvings of nothing took 5 ms
        return met
    inner, outer = met[found], np.maximum(met[found] - STEP_M, start[found])
    for _ in range(BISECTIONS):
        middle = 0.5 * (inner + outer)
        hit = _leaves(cover, terrain, origins[found] + middle[:, None] * directions[found])
        inner, outer = np.where(hit, middle, inner), np.where(hit, outer, middle)
    met[found] = inner
    return met


def _leaves(cover: Cover, terrain: Terrain, points: FloatArray) -> BoolArray:
    """Whether there are leaves at points (n, 3)."""
    north, east = points[:, 0], points[:, 1]
    up = -points[:, 2] - rays.heights(terrain, north, east)
    there = (up >= cover.base_m) & (up <= cover.height_m)
    return np.asarray(there & leafy(north, east, cover.density) & polygons.inside(cover.polygon_m, north, east))


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
