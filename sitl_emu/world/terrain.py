"""Terrain as a height map: one grid that contact physics, lidar and camera all read.

Heights are metres up, above the world origin; positions are metres north and east of it. Between grid points the
surface is bilinear; beyond the grid's edge it continues level, as the height at the edge.
It does not hold overhangs, obstacles or plants.
"""

import math

import cv2
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


class HeightMap:
    """Bilinear surface over a regular grid.

    `grid_m[i, j]` is the height at (north0_m + i * spacing_m, east0_m + j * spacing_m); at least 2 x 2 points.
    Raises ValueError for another shape or a spacing that is not positive.
    """

    def __init__(self, grid_m: FloatArray, north0_m: float, east0_m: float, spacing_m: float) -> None:
        if grid_m.ndim != 2 or min(grid_m.shape) < 2:
            raise ValueError(f"a height map needs at least 2 x 2 heights, not the shape {grid_m.shape}")
        if not spacing_m > 0.0:
            raise ValueError(f"a height map's spacing must be positive, not {spacing_m} m")
        # Single precision, since cv2.remap reads that: so the scalar path sees the very same heights.
        self.grid_m = np.ascontiguousarray(grid_m, dtype=np.float32)
        self.spacing_m, self.highest_m = spacing_m, float(self.grid_m.max())
        self._north0, self._east0 = north0_m, east0_m
        self._inverse_spacing = 1.0 / spacing_m
        self._columns = grid_m.shape[1]
        # A hair below the last cell's end, so that int() never selects a cell that is not there.
        self._y_max = grid_m.shape[0] - 1 - 1e-9
        self._x_max = grid_m.shape[1] - 1 - 1e-9
        self._flat: list[float] = self.grid_m.ravel().tolist()

    @property
    def north0_m(self) -> float:
        """North of the grid's first row."""
        return self._north0

    @property
    def east0_m(self) -> float:
        """East of the grid's first column."""
        return self._east0

    def height_m(self, north_m: float, east_m: float) -> float:
        """Height at one point: the fast path of physics and lidar, about 0.5 µs."""
        y = (north_m - self._north0) * self._inverse_spacing
        x = (east_m - self._east0) * self._inverse_spacing
        if not 0.0 <= y <= self._y_max:
            y = 0.0 if y < 0.0 else self._y_max
        if not 0.0 <= x <= self._x_max:
            x = 0.0 if x < 0.0 else self._x_max
        row, column = int(y), int(x)
        x -= column
        flat = self._flat
        i = row * self._columns + column
        south_west = flat[i]
        south = south_west + (flat[i + 1] - south_west) * x
        i += self._columns
        north_west = flat[i]
        height: float = south + (north_west + (flat[i + 1] - north_west) * x - south) * (y - row)
        return height

    def heights_m(self, north_m: npt.NDArray[np.floating], east_m: npt.NDArray[np.floating]) -> FloatArray:
        """Heights at many points (arrays of one shape), exact to double precision."""
        y = np.clip((np.asarray(north_m, dtype=np.float64) - self._north0) * self._inverse_spacing, 0.0, self._y_max)
        x = np.clip((np.asarray(east_m, dtype=np.float64) - self._east0) * self._inverse_spacing, 0.0, self._x_max)
        row, column = y.astype(np.intp), x.astype(np.intp)
        y, x = y - row, x - column
        g = self.grid_m
        south = g[row, column] * (1.0 - x) + g[row, column + 1] * x
        north = g[row + 1, column] * (1.0 - x) + g[row + 1, column + 1] * x
        return np.asarray(south * (1.0 - y) + north * y, dtype=np.float64)

    def extremes_m(self, south_m: float, west_m: float, north_m: float, east_m: float) -> tuple[float, float]:
        """No height within a rectangle is below the first or above the second."""
        rows, columns = self.grid_m.shape
        first, last = (
            int(np.clip((each - self._north0) // self.spacing_m, 0, rows - 2)) for each in (south_m, north_m)
        )
        left, right = (
            int(np.clip((each - self._east0) // self.spacing_m, 0, columns - 2)) for each in (west_m, east_m)
        )
        part = self.grid_m[first : last + 2, left : right + 2]
        return float(part.min()), float(part.max())


def hills(
    rng: np.random.Generator,
    north_range_m: tuple[float, float],
    east_range_m: tuple[float, float],
    relief_m: float,
    core_size_m: tuple[float, float],
    spacing_m: float = 0.5,
) -> HeightMap:
    """Smooth hills whose highest and lowest point within (0..core north, 0..core east) lie `relief_m` apart.

    Coarse random heights, one every 30 m or so, are joined by cubic interpolation: slopes stay gentle enough to
    drive on. The height at the origin is 0.
    """
    rows = round((north_range_m[1] - north_range_m[0]) / spacing_m) + 1
    columns = round((east_range_m[1] - east_range_m[0]) / spacing_m) + 1
    coarse = rng.normal(size=(math.ceil(rows * spacing_m / 32.0) + 3, math.ceil(columns * spacing_m / 32.0) + 3))
    # A tilt across the field keeps the relief from being all bumps.
    tilt_north, tilt_east = rng.normal(scale=0.35, size=2)
    coarse += tilt_north * np.arange(coarse.shape[0])[:, None] + tilt_east * np.arange(coarse.shape[1])[None, :]
    grid = cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_CUBIC)
    grid = cv2.GaussianBlur(grid, (0, 0), 4.0 / spacing_m)
    first_row, first_column = round(-north_range_m[0] / spacing_m), round(-east_range_m[0] / spacing_m)
    core = grid[
        first_row : first_row + round(core_size_m[0] / spacing_m) + 1,
        first_column : first_column + round(core_size_m[1] / spacing_m) + 1,
    ]
    grid = grid * (relief_m / float(core.max() - core.min()))
    grid = grid - grid[first_row, first_column]
    return HeightMap(np.asarray(grid, dtype=np.float64), north_range_m[0], east_range_m[0], spacing_m)
