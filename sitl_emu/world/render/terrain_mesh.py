"""The ground as meshes: square chunks in levels of detail with skirts, and land far beyond them.

Chunks share their triangles; the corners of each are its own. A skirt hangs from a chunk's edge and hides the gap to a
neighbour of another level.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from sitl_emu.world.ground import Terrain
from sitl_emu.world.rays import heights
from sitl_emu.world.render.kernel import F32, I32

F64 = npt.NDArray[np.float64]

CHUNK = 32
"""Cells along a chunk's side."""
LEVELS = 6
"""The last has one cell to a chunk."""
MOST_POINTS = 1_200_000
"""Of the finest level: beyond, every second height is left out, and so on."""
FAR_M = (20.0, 60.0, 160.0, 400.0, 1000.0, 2500.0, 7000.0, 20000.0)
"""Where land beyond the terrain has its lines."""

HANGS_M = 8.0


class Chunk(NamedTuple):
    """One chunk: the place it is counted from, and for each level its corners about that place and its error in m."""

    place: tuple[float, float, float]
    corners: list[F32]
    errors: list[float]


def level_triangles(side: int) -> I32:
    """Of a chunk of `side` x `side` cells with its skirt: corners row by row, then the skirt's lower edge around."""
    row, column = np.divmod(np.arange(side * side), side)
    a = row * (side + 1) + column
    b, c, d = a + 1, a + side + 1, a + side + 2
    inner = np.stack((a, b, c, b, d, c), axis=1).reshape(-1, 3)
    rim = _rim(side)
    low = (side + 1) ** 2 + np.arange(len(rim))
    following = np.roll(np.arange(len(rim)), -1)
    one = np.stack((rim, low, rim[following]), axis=1)
    other = np.stack((rim[following], low, low[following]), axis=1)
    return np.concatenate((inner, one, other)).astype(np.int32)


def _rim(side: int) -> npt.NDArray[np.intp]:
    """The corners around a chunk: north along its west edge, then east, south and west."""
    step = side + 1
    south_west = np.arange(side)
    return np.concatenate(
        (south_west * step, side * step + south_west, (side - south_west) * step + side, side - south_west)
    ).astype(np.intp)


def chunks(terrain: Terrain, north: F64, east: F64) -> list[Chunk]:
    """Chunks of a regular grid of lines, whose count less one is a multiple of CHUNK."""
    grid = heights(terrain, *np.meshgrid(north, east, indexing="ij")).astype(np.float64)
    made = []
    for row in range(0, len(north) - 1, CHUNK):
        strip = sliding_window_view(grid[row : row + CHUNK + 1], CHUNK + 1, axis=1)[:, ::CHUNK].transpose(1, 0, 2)
        made += _strip(strip, north[row : row + CHUNK + 1], sliding_window_view(east, CHUNK + 1)[::CHUNK])
    return made


def _strip(parts: F64, north: F64, east: F64) -> list[Chunk]:
    """Chunks (n, CHUNK + 1, CHUNK + 1) beside each other, with the lines (CHUNK + 1,) of all and (n, CHUNK + 1)."""
    half = CHUNK // 2
    middle = np.stack((np.full(len(parts), north[half]), east[:, half], -parts.mean(axis=(1, 2))), axis=1)
    levels, errors = [], []
    for level in range(LEVELS):
        step, side = 1 << level, (CHUNK >> level) + 1
        error = _errors(parts, step)
        points = np.empty((len(parts), side, side, 3))
        points[..., 0] = (north[::step] - north[half])[:, None]
        points[..., 1] = (east[:, ::step] - east[:, half, None])[:, None]
        points[..., 2] = -parts[:, ::step, ::step] - middle[:, 2, None, None]
        flat = points.reshape(len(parts), -1, 3)
        skirt = flat[:, _rim(CHUNK // step)]
        skirt[..., 2] += (2.0 * error + 0.02 * step * (north[1] - north[0]))[:, None]
        levels.append(np.concatenate((flat, skirt), axis=1).astype(np.float32))
        errors.append(error)
    return [
        Chunk((float(n), float(e), float(d)), [level[k] for level in levels], [float(error[k]) for error in errors])
        for k, (n, e, d) in enumerate(middle)
    ]


def _errors(parts: F64, step: int) -> F64:
    """(n,): the largest distance, up or down, of coarser grids from the finest, of each chunk."""
    if step == 1:
        return np.zeros(len(parts))
    place = np.arange(CHUNK + 1) / step
    low = np.minimum(place.astype(int), CHUNK // step - 1)
    share = place - low
    coarse = parts[:, ::step, ::step]
    rows = coarse[:, low] * (1 - share)[:, None] + coarse[:, low + 1] * share[:, None]
    whole = rows[..., low] * (1 - share) + rows[..., low + 1] * share
    return np.asarray(np.abs(whole - parts).max(axis=(1, 2)))


def far_land(terrain: Terrain, north: F64, east: F64) -> tuple[F64, I32]:
    """Corners (NED) and triangles of land around a rectangle to the horizon; `north`, `east`: its lines."""
    reach = np.array(FAR_M)
    n = np.concatenate((north[0] - reach[::-1], north, north[-1] + reach))
    e = np.concatenate((east[0] - reach[::-1], east, east[-1] + reach))
    grid_n, grid_e = np.meshgrid(n, e, indexing="ij")
    corners = np.stack((grid_n, grid_e, -heights(terrain, grid_n, grid_e)), axis=2).reshape(-1, 3)
    row, column = np.divmod(np.arange((len(n) - 1) * (len(e) - 1)), len(e) - 1)
    count = len(reach)
    inside = (row >= count) & (row < len(n) - 1 - count) & (column >= count) & (column < len(e) - 1 - count)
    a = (row * len(e) + column)[~inside]
    b, c, d = a + 1, a + len(e), a + len(e) + 1
    triangles = np.stack((a, b, c, b, d, c), axis=1).reshape(-1, 3)
    # Around the rectangle it hangs down, as its lines there are straighter than the terrain's edge
    rows, columns = np.arange(count, len(n) - count), np.arange(count, len(e) - count)
    rim = [row * len(e) + columns[0] for row in rows] + [rows[-1] * len(e) + column for column in columns[1:]]
    rim += [row * len(e) + columns[-1] for row in rows[-2::-1]] + [rows[0] * len(e) + k for k in columns[-2:0:-1]]
    low = len(corners) + np.arange(len(rim))
    corners = np.concatenate((corners, corners[rim] + (0.0, 0.0, HANGS_M)))
    here, there, below = np.array(rim), np.roll(rim, -1), np.roll(low, -1)
    skirt = np.concatenate((np.stack((here, low, there), axis=1), np.stack((there, low, below), axis=1)))
    return corners, np.concatenate((triangles, skirt)).astype(np.int32)
