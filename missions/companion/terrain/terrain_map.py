"""A map of the ground's height, made in flight: a 2.5-D grid of fixed resolution, a mean and a variance per cell.

Each cell weighs its soundings by the inverse of their noise's variance, which is the Kalman filter of a height that
stays. Only sums are kept, so that the order does not matter, two maps of one area are added, and a sounding costs the
same whenever it comes. The variance of a height has four parts: the noise, which averages out; the scatter of the
cell's soundings, its own relief; what they share, the receiver's and the sensor's lasting error; and the place's error
times the slope towards the neighbours. What was never measured is NaN, never 0.

Metres north and east of the caller's origin, heights upwards from it. Row 0 is the southernmost, column 0 the
westernmost.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.terrain.soundings import Sounding

Grid = npt.NDArray[np.float64]
MOST_CELLS = 4_000_000
"""Ours: 2 km square a metre apart take 200 MB."""
LEAST_SIGMA_M = 1e-3
"""No sounding is better: a single weight would drown all others."""


class Bounds(NamedTuple):
    """An area with its sides north-south and east-west, in metres."""

    south_m: float
    west_m: float
    north_m: float
    east_m: float


class Height(NamedTuple):
    """Of the ground at a place, with one sigma; both NaN where it is not known."""

    mean_m: float
    sigma_m: float


UNKNOWN = Height(math.nan, math.nan)


class TerrainMap:
    """Takes soundings, gives heights."""

    def __init__(self, bounds: Bounds, resolution_m: float = 1.0) -> None:
        """Raises ValueError for bounds without extent, and for more cells than `MOST_CELLS`."""
        south, west, north, east = bounds
        if not (resolution_m > 0.0 and north > south and east > west and math.isfinite(north - south + east - west)):
            raise ValueError(f"terrain map: {bounds} in cells of {resolution_m:g} m; must have an extent")
        rows, columns = math.ceil((north - south) / resolution_m), math.ceil((east - west) / resolution_m)
        if rows * columns > MOST_CELLS:
            raise ValueError(f"terrain map: {rows} x {columns} cells; at most {MOST_CELLS}: take a coarser resolution")
        self.south_m, self.west_m, self.resolution_m = south, west, resolution_m
        self.shape = rows, columns
        self.outside = 0
        """Soundings that lay outside the map, or were no numbers."""
        self._sums = np.zeros((5, rows, columns))
        """Of weights, and of weights times: height, its square, epv squared, eph squared."""

    def add(self, soundings: Iterable[Sounding]) -> None:
        """Takes in more of them; which are to be believed is `soundings.believed`'s to say."""
        data = np.array([one[1:] for one in soundings], dtype=np.float64).reshape(-1, 6)
        row, column = np.floor((data[:, :2] - (self.south_m, self.west_m)) / self.resolution_m).T
        within = np.isfinite(data).all(axis=1) & (row >= 0) & (row < self.shape[0])
        within &= (column >= 0) & (column < self.shape[1])
        self.outside += len(data) - int(within.sum())
        _, _, height, sigma, eph, epv = data[within].T
        at = row[within].astype(np.int64), column[within].astype(np.int64)
        weight = 1.0 / np.maximum(sigma, LEAST_SIGMA_M) ** 2
        for total, part in zip(self._sums, (1.0, height, height**2, epv**2, eph**2), strict=True):
            np.add.at(total, at, weight * part)

    def merge(self, other: "TerrainMap") -> None:
        """Takes in what another map of the same cells holds. Raises ValueError for other cells."""
        cells = [(one.south_m, one.west_m, one.resolution_m, one.shape) for one in (self, other)]
        if cells[0] != cells[1]:
            raise ValueError("terrain map: only maps of the same cells can be merged")
        self._sums += other._sums
        self.outside += other.outside

    def means_m(self) -> Grid:
        """The heights (rows, columns); NaN where none was measured."""
        return _means(self._sums)

    def sigmas_m(self) -> Grid:
        """One sigma of each of them."""
        return _sigmas(self._sums, self.resolution_m)

    def noises_m(self) -> Grid:
        """One sigma of what chance alone has put a cell off, beside its neighbours: the noise, which none share."""
        return np.where(self._sums[0] > 0.0, np.sqrt(_noises_squared(self._sums)), np.nan)

    def height_m(self, north_m: float, east_m: float) -> Height:
        """The ground's height at a place: that of its cell."""
        row, column = self.cell(north_m, east_m)
        if not (0 <= row < self.shape[0] and 0 <= column < self.shape[1]):
            return UNKNOWN
        means, sigmas = self.part(int(row), int(column), 1, 1)
        return Height(float(means[0, 0]), float(sigmas[0, 0]))

    def cell(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Row and column of a place, whole numbers, also beyond the map; NaN of a place that is not known."""
        row, column = np.floor((np.array((north_m, east_m)) - (self.south_m, self.west_m)) / self.resolution_m)
        return float(row), float(column)

    def part(self, row: int, column: int, rows: int, columns: int) -> tuple[Grid, Grid]:
        """Heights and sigmas of some cells, from a southernmost and a westernmost on; NaN beyond the map."""
        # a cell's sigma takes its neighbours' heights: one more all around, without weight beyond the map
        sums = np.zeros((5, rows + 2, columns + 2))
        south, west = max(row - 1, 0), max(column - 1, 0)
        north, east = min(row + rows + 1, self.shape[0]), min(column + columns + 1, self.shape[1])
        if north > south and east > west:
            at = south - row + 1, west - column + 1
            sums[:, at[0] : at[0] + north - south, at[1] : at[1] + east - west] = self._sums[:, south:north, west:east]
        return _means(sums)[1:-1, 1:-1], _sigmas(sums, self.resolution_m)[1:-1, 1:-1]


def _means(sums: Grid, which: int = 1) -> Grid:
    with np.errstate(invalid="ignore"):
        return np.asarray(sums[which] / sums[0])


def _noises_squared(sums: Grid) -> Grid:
    """What is left of the soundings' noise; infinite where there is none."""
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / sums[0])


def _sigmas(sums: Grid, resolution_m: float) -> Grid:
    mean, noise = _means(sums), _noises_squared(sums)
    scatter = np.maximum(_means(sums, 2) - mean**2, 0.0)
    return np.asarray(np.sqrt(noise + scatter + _means(sums, 3) + _slope_squared(mean, resolution_m) * _means(sums, 4)))


def _slope_squared(mean: Grid, resolution_m: float) -> Grid:
    """The steepest towards a known neighbour north or south, squared, plus the same of east and west."""
    padded = np.pad(mean, 1, constant_values=np.nan)
    north_south = np.fmax(np.abs(padded[2:, 1:-1] - mean), np.abs(padded[:-2, 1:-1] - mean))
    east_west = np.fmax(np.abs(padded[1:-1, 2:] - mean), np.abs(padded[1:-1, :-2] - mean))
    return np.asarray((np.nan_to_num(north_south) ** 2 + np.nan_to_num(east_west) ** 2) / resolution_m**2)
