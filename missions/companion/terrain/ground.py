"""What of a mapped height is ground, and what stands on it.

Corners are mostly those of roofs, and cars. The ground is what does not rise above the lowest about it by more than
ground does, as in the filters of airborne lidar (G. Vosselman, Slope based filtering of laser altimetry data, 2000;
T. Pingel, K. Clarke and W. McBride, An improved simple morphological filter, 2013), once what lies alone, or alone
below all about it, is gone: a corner that was confused with another, which would be the ground to such a filter (Z.
Chen, B. Devereux, B. Gao and G. Amable, Upward-fusion urban DTM generating method using airborne lidar data, 2012;
PDAL's filters.elm, and filters.outlier by radius).

Heights are those of a `TerrainMap`'s cells, in metres upwards, shape (rows, columns), NaN where nothing is known;
`resolution_m` is how far cells are apart.
"""

import math
from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.terrain.terrain_map import Grid

REACH_M = 4.0
"""How far a height tells of the ground about it: one sigma of a Gaussian; ours."""
SLOPE, STEP_M = 0.15, 0.5
"""How steep ground is, and what its heights are off: the slope and threshold that Pingel's filter has in PDAL
(filters.smrf). Its window of 18 m we don't have: corners are sparse, and a roof's edge of 24 cells, 14 m high, had no
ground within that and was taken for some (town of seed 3: its error was 1.28 m, and is 0.46 m mapped again; seven other
towns' maps, three debris fields' and two of three fires' are the same to the millimetre, the third's is 0.190 m off
instead of 0.185)."""
HILL_M = 6.0
"""What is ground about a cell, by a Gaussian of that sigma, is the hill that it lies on: ours, a third of PDAL's
window, so that what stands does not bend it. Of ten wildfires' maps (seeds 1 to 10, mapped again) the error was 0.42 m
without, and 0.38, 0.36 and 0.36 m with 8, 6 and 5 m; of ten debris fields' 0.22 m by all of them."""
HILL_ROUNDS = 16
"""How often it is told anew, at most: it stops where no cell comes or goes, in four rounds or so."""
ALONE_M, TOGETHER = 5.0, 3
"""Fewer cells than that within this distance, to which ground could rise or fall, are none. The first is half the
window of filters.elm, which takes the lowest alone; ours are two where a corner lies on a border of cells."""
LEAST_WEIGHT = 1e-3
"""Of all heights about a place: where there is less, none is known; ours."""
AMONG_M, AMONG = 1.5, 0.02
"""How far a height tells in a map that is kept, and the least weight there: it ends 2.4 m from a single cell; ours."""


def ground(means_m: Grid, resolution_m: float, noises_m: Grid | float = 0.0) -> Grid:
    """Heights of the cells that are ground; NaN where none is known, something stands, or one is low alone.

    `noises_m`: how low a cell may seem by chance, where it is not known well.
    """
    means_m = _without_lone(means_m, resolution_m)
    known = np.where(np.isfinite(means_m), means_m, np.inf)
    highest = _cones(known + np.nan_to_num(noises_m), SLOPE * resolution_m)
    return np.where(known <= highest + STEP_M, means_m, np.nan)


def _cones(heights_m: Grid, rise_m: float) -> Grid:
    """The lowest of all cones that stand on cells and rise by so much from one to the next, diagonally by its root 2.

    A distance transform in two passes (G. Borgefors, Distance transformations, 1986): a shortest way goes either down
    the rows or up, and along them.
    """
    lowest, along = heights_m.copy(), rise_m * np.arange(heights_m.shape[1])
    across_m = rise_m * math.sqrt(2.0)
    for rows in (lowest, lowest[::-1]):
        before = np.full(len(along), np.inf)
        for row in rows:
            np.minimum(row, before + rise_m, out=row)
            np.minimum(row[1:], before[:-1] + across_m, out=row[1:])
            np.minimum(row[:-1], before[1:] + across_m, out=row[:-1])
            np.minimum(row, np.minimum.accumulate(row - along) + along, out=row)
            np.minimum(row, np.minimum.accumulate((row + along)[::-1])[::-1] - along, out=row)
            before = row
    return lowest


def ground_on_hills(means_m: Grid, resolution_m: float) -> Grid:
    """The same where hills are steeper than `SLOPE`: it counts from the hill, which what was ground before tells.

    Takes a few times as long, and so is for the map that is kept alone.
    """
    found = ground(means_m, resolution_m)
    for _ in range(HILL_ROUNDS):
        before = found
        over_m = means_m - _hills(found, resolution_m)
        found = np.where(np.isfinite(ground(over_m, resolution_m)), means_m, np.nan)
        if np.array_equal(found, before, equal_nan=True):
            break
    return found


def _hills(means_m: Grid, resolution_m: float) -> Grid:
    """The ground smoothed, of every cell: far from all that is known their mean."""
    known = np.isfinite(means_m)
    if not known.any():
        return np.zeros(means_m.shape)
    weight, total = (_blurred(values, known, HILL_M / resolution_m) for values in (1.0, means_m))
    return np.asarray((total + LEAST_WEIGHT * means_m[known].mean()) / (weight + LEAST_WEIGHT))


def _blurred(values: Grid | float, known: npt.NDArray[np.bool_], sigma_cells: float) -> Grid:
    """The known cells' values times a Gaussian's weights, summed about every cell; of 1, the weights alone."""
    return np.asarray(cv2.GaussianBlur(np.where(known, values, 0.0), (0, 0), sigma_cells), np.float64)


def _without_lone(means_m: Grid, resolution_m: float) -> Grid:
    """Without cells from which ground would have to rise too steeply to all but a few about them, and few alone."""
    known = np.where(np.isfinite(means_m), means_m, np.inf)
    within_reach = np.zeros(known.shape, np.int64)
    for there, away_m in _shifted(known, resolution_m, ALONE_M):
        within_reach += np.isfinite(there) & (there <= known + STEP_M + SLOPE * away_m)
    return np.where(within_reach < TOGETHER, np.nan, means_m)


def _shifted(heights_m: Grid, resolution_m: float, within_m: float) -> Iterator[tuple[Grid, float]]:
    """What each cell has at a place beside it, infinity beyond the map, and how far that is; itself among them."""
    reach = math.floor(within_m / resolution_m)
    around = np.pad(heights_m, reach, constant_values=np.inf)
    for row in range(-reach, reach + 1):
        for column in range(-reach, reach + 1):
            away_m = resolution_m * math.hypot(row, column)
            if away_m <= within_m:
                yield around[reach + row :, reach + column :][: heights_m.shape[0], : heights_m.shape[1]], away_m


def about(means_m: Grid, sigmas_m: Grid, resolution_m: float) -> tuple[Grid, Grid]:
    """Heights and sigmas of cells that are known, or lie among such: weighed means of those about; else NaN.

    The heights over the hill are what is weighed: beside a slope's lowest cell it goes on downwards.
    """
    known, hills_m = np.isfinite(means_m), _hills(means_m, resolution_m)
    over_m = means_m - hills_m
    weight, total, squares = (
        _blurred(values, known, AMONG_M / resolution_m) for values in (1.0, over_m, sigmas_m**2 + over_m**2)
    )
    weight = np.where(weight >= AMONG, weight, np.nan)
    mean = total / weight
    spread_m2 = squares / weight - mean**2
    return mean + hills_m, np.sqrt(np.maximum(spread_m2, 0.0))


def spread(means_m: Grid, resolution_m: float) -> Grid:
    """Heights of all cells: known ones, and between them the mean of those about; far from all of them NaN."""
    known = np.isfinite(means_m)
    weight, total = (_blurred(values, known, REACH_M / resolution_m) for values in (1.0, means_m))
    about = np.where(weight > LEAST_WEIGHT, total / np.maximum(weight, LEAST_WEIGHT), np.nan)
    return np.where(known, means_m, about)
