"""Rays that march over a height map, one at a time: down to the ground, or into leaves.

Written for numba, which compiles them for whoever has many rays (`compiled`): a scan of 5760 takes a tenth of what
numpy took with all rays at once. A single beam, of which a flying vehicle has one every few ticks, is followed in plain
Python, without numba in its process. Both come to the same bits: there is nothing but IEEE arithmetic in it.

Arrays are `origins` and `directions` (n, 3; NED, m), and `ranges` (n,), which is written: inf where nothing is met. A
height map comes as `Grid`. How it is read between its points stands in both, since a function that is shared would have
to be compiled before Python could call it; `terrain.HeightMap` has it, too, and tests hold them to the same figures.
"""

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.ground import Terrain
from sitl_emu.world.terrain import HeightMap

FloatArray = npt.NDArray[np.float64]

MANY = 32
"""Rays from which compiled code pays, once it is loaded. Ours."""
LOW_32 = 0xFFFFFFFF


class Grid(NamedTuple):
    """A `terrain.HeightMap` in plain data."""

    heights_m: npt.NDArray[np.float32]
    north0_m: float
    east0_m: float
    per_m: float
    """Points a metre; 0: the first point's height everywhere."""
    highest_m: float


def grid_of(terrain: Terrain) -> Grid:
    """Of a world's terrain: a map, or level ground."""
    if isinstance(terrain, HeightMap):
        south_m, west_m = float(terrain.north0_m), float(terrain.east0_m)
        return Grid(terrain.grid_m, south_m, west_m, 1.0 / terrain.spacing_m, terrain.highest_m)
    level_m = float(terrain.height_m(0.0, 0.0))
    return Grid(np.full((2, 2), level_m, np.float32), 0.0, 0.0, 0.0, level_m)


def ground(
    origins: FloatArray,
    directions: FloatArray,
    step_m: float,
    steps: int,
    halvings: int,
    grid: Grid,
    ranges: FloatArray,
) -> None:
    """Where rays first pass below the ground, looked at each `step_m`; the last step is then halved so often."""
    heights_m, north0_m, east0_m, per_m, highest_m = grid
    last_row, last_column = heights_m.shape[0] - 1 - 1e-9, heights_m.shape[1] - 1 - 1e-9
    for ray in range(len(origins)):
        clear, met, at, count, halved = 0.0, math.inf, step_m, 1, 0
        while True:
            y = (origins[ray, 0] + at * directions[ray, 0] - north0_m) * per_m
            x = (origins[ray, 1] + at * directions[ray, 1] - east0_m) * per_m
            y, x = min(max(y, 0.0), last_row), min(max(x, 0.0), last_column)
            row, column = int(y), int(x)
            y, x = y - row, x - column
            south = float(heights_m[row, column]) * (1.0 - x) + float(heights_m[row, column + 1]) * x
            north = float(heights_m[row + 1, column]) * (1.0 - x) + float(heights_m[row + 1, column + 1]) * x
            up = -(origins[ray, 2] + at * directions[ray, 2])
            if up < south * (1.0 - y) + north * y:
                met = at
            else:
                clear = at
            if met == math.inf:
                count += 1
                if count > steps or (up > highest_m and directions[ray, 2] <= 0.0):
                    break
                at = count * step_m
            else:
                if halved == halvings:
                    break
                halved += 1
                at = 0.5 * (clear + met)
        ranges[ray] = met


def leaves(
    origins: FloatArray, directions: FloatArray, starts: FloatArray, ends: FloatArray, step_m: float, halvings: int,
    base_m: float, top_m: float, share: float, cell_m: float, edges: FloatArray, grid: Grid, ranges: FloatArray
) -> None:  # fmt: skip
    """Where rays first meet leaves between their `starts` and `ends` (n,; start > end: nowhere), as `foliage` has them.

    `share`: of 2**32, below which a cell's hash means leaves; `edges`: (m, 4), sides of the cover's polygon from north,
    east to north, east.
    """
    heights_m, north0_m, east0_m, per_m, _ = grid
    last_row, last_column = heights_m.shape[0] - 1 - 1e-9, heights_m.shape[1] - 1 - 1e-9
    for ray in range(len(origins)):
        start, end = starts[ray], ends[ray]
        clear, met, at, count, halved = start, math.inf, start, 0, 0
        while start <= end:  # else it is never among them
            n, e = origins[ray, 0] + at * directions[ray, 0], origins[ray, 1] + at * directions[ray, 1]
            # the cell's hash (32 bits of its two numbers)
            r, c = math.floor(n / cell_m) & LOW_32, math.floor(e / cell_m) & LOW_32
            mixed = ((r * 0x9E3779B1) & LOW_32) ^ ((c * 0x85EBCA77) & LOW_32)
            mixed = ((mixed ^ (mixed >> 15)) * 0x2C1B3C6D) & LOW_32
            mixed = ((mixed ^ (mixed >> 12)) * 0x297A2D39) & LOW_32
            mixed ^= mixed >> 15
            is_leaf = mixed < share
            if is_leaf:
                y, x = (n - north0_m) * per_m, (e - east0_m) * per_m
                y, x = min(max(y, 0.0), last_row), min(max(x, 0.0), last_column)
                row, column = int(y), int(x)
                y, x = y - row, x - column
                south = float(heights_m[row, column]) * (1.0 - x) + float(heights_m[row, column + 1]) * x
                north = float(heights_m[row + 1, column]) * (1.0 - x) + float(heights_m[row + 1, column + 1]) * x
                up = -(origins[ray, 2] + at * directions[ray, 2]) - (south * (1.0 - y) + north * y)
                is_leaf = base_m <= up <= top_m
            if is_leaf:
                is_inside = False
                for side in range(len(edges)):
                    n0, e0, n1, e1 = edges[side, 0], edges[side, 1], edges[side, 2], edges[side, 3]
                    if (n0 > n) != (n1 > n) and e < e0 + (n - n0) * ((e1 - e0) / (n1 - n0)):
                        is_inside = not is_inside
                is_leaf = is_inside
            if is_leaf:
                clear, met = (max(at - step_m, start), at) if met == math.inf else (clear, at)
            else:
                clear = at
            if met == math.inf:
                if at >= end:
                    break
                count += 1
                at = min(start + count * step_m, end)
            else:
                if halved == halvings:
                    break
                halved += 1
                at = 0.5 * (met + clear)
        ranges[ray] = met


def run(function: Any, origins: FloatArray, directions: FloatArray, *others: Any) -> FloatArray:
    """Call one of these, as it pays; its `ranges`."""
    ranges = np.empty(len(origins))
    march = compiled(function) if len(origins) >= MANY else function
    march(np.ascontiguousarray(origins), np.ascontiguousarray(directions), *others, ranges)
    return ranges


@cache
def compiled(function: Any) -> Any:
    """One of these, by numba."""
    from sitl_emu.world.render.kernel import kernel  # numba, for whoever has many rays

    return kernel(function)
