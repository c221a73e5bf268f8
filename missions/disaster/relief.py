"""The ground under a flight: mapped on the way (`companion/terrain`), used to place what is seen, and to fly over.

**What is flown at which height.** The scan flies at `scan_altitude_m`, where the lidar is blind, and the map comes from
corners' rays; the lidar adds take-off, each descent to a place, and the landing. With `altitude: terrain` the scan
keeps that height over the ground, and `CLEARANCE_M` over all that is mapped ahead, roofs too; else it keeps the height
above home. What is not mapped counts as home's height, with the option's `ground_sigma_m`; between mapped cells the
height is that of those about, weighed by their distance.

Corners are mostly those of roofs, and cars. The ground is what does not rise above the lowest about it by more than
ground does, as in the filters of airborne lidar (G. Vosselman, Slope based filtering of laser altimetry data, 2000;
T. Pingel, K. Clarke and W. McBride, An improved simple morphological filter, 2013), once what lies alone, or alone
below all about it, is gone: a corner that was confused with another, which would be the ground to such a filter (Z.
Chen, B. Devereux, B. Gao and G. Amable, Upward-fusion urban DTM generating method using airborne lidar data, 2012;
PDAL's filters.elm, and filters.outlier by radius). Sightings are placed on the ground, and it alone is kept as the
terrain map, with slopes that count from the hill they lie on (`ground_on_hills`), without the flight's own drift
(`companion/terrain/crossover.py`) and, between what was measured, as `about` has it; what is flown over are roofs and
trees as well.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import CameraModel, Sweep
from sitl_emu.missions.companion.terrain import files
from sitl_emu.missions.companion.terrain.features import Feature
from sitl_emu.missions.companion.terrain.following import Following, next_altitude
from sitl_emu.missions.companion.terrain.survey import Survey
from sitl_emu.missions.companion.terrain.terrain_map import Bounds, TerrainMap
from sitl_emu.missions.disaster.places import Standing
from sitl_emu.missions.disaster.regions import RESOLUTION_M, Cells, Grid

EVERY_US = 1_000_000
REACH_M = 4.0
"""How far a height tells of the ground about it: one sigma of a Gaussian; ours."""
ABOUT_M, SLOPE, STEP_M = 18.0, 0.15, 0.5
"""How far the lowest may be, how steep ground is, and what its heights are off: the window, slope and threshold that
Pingel's filter has in PDAL (filters.smrf). No house of ours is wider than twice the first."""
HILL_M = 6.0
"""What is ground about a cell, by a Gaussian of that sigma, is the hill that it lies on: ours, a third of the first, so
that what stands does not bend it. Of ten wildfires' maps (seeds 1 to 10, mapped again) the error was 0.42 m without,
and 0.38, 0.36 and 0.36 m with 8, 6 and 5 m; of ten debris fields' 0.22 m by all of them."""
HILL_ROUNDS = 16
"""How often it is told anew, at most: it stops where no cell comes or goes, in four rounds or so."""
ALONE_M, TOGETHER = 5.0, 3
"""Fewer cells than that within this distance, to which ground could rise or fall, are none. The first is half the
window of filters.elm, which takes the lowest alone; ours are two where a corner lies on a border of cells."""
BESIDE_M = 1.5 * RESOLUTION_M
"""Nearer than that are the eight cells about one."""
STANDS_M = 1.0
"""What is mapped so high over the ground stands: a wall, a car, a tree; ours."""
UNDER_M = 2.0
"""What reaches no higher than so much under the vehicle, it may be over; ours: the heights of both are off."""
LEAST_WEIGHT = 1e-3
AMONG_M, AMONG = 1.5, 0.02
"""The same in the map that is kept, and the least weight there: it ends 2.4 m from a single cell; ours."""
HOME_M = 3.0
"""What was sounded so near to home is its ground."""
CLEARANCE_M, SIGMAS = 10.0, 1.0
"""Over what is flown over, and what is added to its mapped height; ours."""
LEAD_M, SLOWEST_M_S = 9.0, 2.0
"""How far ahead the ground counts, 1.8 s at 5 m/s: half of the time between two waypoints, and what a vehicle takes to
rise or sink by half a metre; and what one that begins a line is taken to fly at. Ours."""
CARROT_M = 18.0
"""PX4 flies to a place in a straight line, which rises evenly (PositionSmoothing): to follow the ground it is sent so
far ahead, again and again, not to the line's end. Ours: 12 m before a place it slows down from 5 m/s (MPC_ACC_HOR,
MPC_JERK_AUTO), and it has flown 5 when it is sent on."""


class Relief:
    """The map, as the flight reads it."""

    def __init__(
        self, bounds: Bounds, camera: CameraModel, scan_altitude_m: float, release_height_m: float, *, placing: bool
    ) -> None:
        """`scan_altitude_m`: to fly over the ground; parcels are let go from `release_height_m` over it.

        `placing`: whether sightings are placed by the map.
        """
        self.survey = Survey(bounds, camera, RESOLUTION_M)
        self._following = Following(clearance_m=CLEARANCE_M, sigmas=SIGMAS)
        self._scan_altitude_m = scan_altitude_m
        self.held_m = scan_altitude_m
        """Above home: what was wanted last on a line."""
        self._placing, self._tall_m = placing, release_height_m - UNDER_M
        self._heights_m: Grid | float = 0.0
        self.stands: Standing | None = None
        """None as long as nothing is mapped."""
        self._due_us = 0

    def on_features(self, time_us: int, sweep: Sweep, features: Sequence[Feature], eph_m: float, epv_m: float) -> None:
        """See Survey."""
        self.survey.on_features(time_us, sweep, features, eph_m, epv_m)

    def heights_m(self, now_us: int) -> Grid | float:
        """Heights of the ground over home, of the map's cells, to place sightings by."""
        if self._placing and now_us >= self._due_us:
            self._due_us = now_us + EVERY_US
            self._heights_m = np.nan_to_num(spread(ground(self.survey.terrain.means_m())))
            # a house that is flown over now is in no finished map yet
            now = self.survey.so_far()
            lowest = ground(now.means_m(), now.noises_m())
            rises_m = now.means_m() - np.nan_to_num(spread(lowest))
            self.stands = Standing(
                rises_m > STANDS_M, rises_m > max(self._tall_m, STANDS_M), np.asarray(np.isfinite(lowest))
            )
        return self._heights_m

    def at(self, place_m: Corner, unknown_sigma_m: float) -> tuple[float, float]:
        """The ground's height over home at a place, and one sigma of it."""
        height = self.survey.terrain.height_m(*place_m)
        return (height.mean_m, height.sigma_m) if math.isfinite(height.mean_m) else (0.0, unknown_sigma_m)

    def waypoint(self, here_m: Corner, to_m: Corner, speed_m_s: float, altitude_m: float) -> tuple[Corner, float]:
        """Where to fly next on the way to a place, and at which height above home, from `altitude_m` now.

        Straight on from here it leads through the height that is wanted `LEAD_M` ahead: the scan's over the farthest
        ground that is known till there, where none is the last one, and clear of what is mapped ahead.
        """
        left_m, course = math.dist(here_m, to_m), math.atan2(to_m[1] - here_m[1], to_m[0] - here_m[0])
        lead_m = min(LEAD_M, left_m)
        terrain = self.survey.so_far()
        ground_m = _farthest(terrain, here_m, course, lead_m)
        if math.isfinite(ground_m):
            self.held_m = ground_m + self._scan_altitude_m
        lead_s = lead_m / max(speed_m_s, SLOWEST_M_S)
        soon_m = max(
            next_altitude(
                terrain, place_m, course, speed_m_s, altitude_m, lead_s, self._following, self.held_m
            ).altitude_m
            for place_m in (here_m, _along(here_m, course, lead_m))
        )
        if left_m <= lead_m:
            return to_m, soon_m
        carrot_m = min(CARROT_M, left_m)
        return _along(here_m, course, carrot_m), altitude_m + (soon_m - altitude_m) * carrot_m / lead_m

    def write(self, path: Path, home: tuple[float, float, float]) -> float:
        """The ground as GeoTIFF; how high over `home` the ground there is by the lidar, 0 if it told nothing there.

        Raises OSError.
        """
        self.survey.finish()
        terrain, soundings = self.survey.adjusted()
        files.write_geotiff(path, terrain, *home, about(ground_on_hills(terrain.means_m()), terrain.sigmas_m()))
        at_home = [one.height_m for one in soundings if math.hypot(one.north_m, one.east_m) <= HOME_M]
        return float(np.median(at_home)) if at_home else 0.0


def _along(from_m: Corner, course_rad: float, by_m: float) -> Corner:
    return from_m[0] + by_m * math.cos(course_rad), from_m[1] + by_m * math.sin(course_rad)


def _farthest(terrain: TerrainMap, here_m: Corner, course_rad: float, within_m: float) -> float:
    """The height of the farthest ground that is known on a course, or lies among such; NaN where there is none."""
    heights_m = spread(ground(terrain.means_m(), terrain.noises_m()))
    for away_m in np.arange(within_m, -RESOLUTION_M, -RESOLUTION_M).tolist():
        row, column = (int(at) for at in terrain.cell(*_along(here_m, course_rad, away_m)))
        inside = 0 <= row < terrain.shape[0] and 0 <= column < terrain.shape[1]
        if inside and math.isfinite(heights_m[row, column]):
            return float(heights_m[row, column])
    return math.nan


def ground(means_m: Grid, noises_m: Grid | float = 0.0) -> Grid:
    """Heights of the cells that are ground; NaN where none is known, something stands, or one is low alone.

    `noises_m`: how low a cell may seem by chance, where it is not known well.
    """
    means_m = _without_lone(means_m)
    known = np.where(np.isfinite(means_m), means_m, np.inf)
    # a cone of that slope over each cell, grown from cell to cell (G. Borgefors, Distance transformations, 1986)
    highest = known + np.nan_to_num(noises_m)
    for _ in range(round(ABOUT_M / RESOLUTION_M)):
        highest = np.minimum.reduce([beside + SLOPE * away_m for beside, away_m in _shifted(highest, BESIDE_M)])
    return np.where(known <= highest + STEP_M, means_m, np.nan)


def ground_on_hills(means_m: Grid) -> Grid:
    """The same where hills are steeper than `SLOPE`: it counts from the hill, which what was ground before tells.

    Takes a few times as long, and so is for the map that is kept alone.
    """
    found = ground(means_m)
    for _ in range(HILL_ROUNDS):
        before, found = found, np.where(np.isfinite(ground(means_m - _hills(found))), means_m, np.nan)
        if np.array_equal(found, before, equal_nan=True):
            break
    return found


def _hills(means_m: Grid) -> Grid:
    """The ground smoothed, of every cell: far from all that is known their mean."""
    known = np.isfinite(means_m)
    if not known.any():
        return np.zeros(means_m.shape)
    weight, total = (_blurred(values, known, HILL_M) for values in (1.0, means_m))
    return np.asarray((total + LEAST_WEIGHT * means_m[known].mean()) / (weight + LEAST_WEIGHT))


def _blurred(values: Grid | float, known: Cells, sigma_m: float) -> Grid:
    """The known cells' values times a Gaussian's weights, summed about every cell; of 1, the weights alone."""
    return np.asarray(cv2.GaussianBlur(np.where(known, values, 0.0), (0, 0), sigma_m / RESOLUTION_M), np.float64)


def _without_lone(means_m: Grid) -> Grid:
    """Without cells from which ground would have to rise too steeply to all but a few about them, and few alone."""
    known = np.where(np.isfinite(means_m), means_m, np.inf)
    within_reach = np.zeros(known.shape, np.int64)
    for there, away_m in _shifted(known, ALONE_M):
        within_reach += np.isfinite(there) & (there <= known + STEP_M + SLOPE * away_m)
    return np.where(within_reach < TOGETHER, np.nan, means_m)


def _shifted(heights_m: Grid, within_m: float) -> Iterator[tuple[Grid, float]]:
    """What each cell has at a place beside it, infinity beyond the map, and how far that is; itself among them."""
    reach = math.floor(within_m / RESOLUTION_M)
    around = np.pad(heights_m, reach, constant_values=np.inf)
    for row in range(-reach, reach + 1):
        for column in range(-reach, reach + 1):
            away_m = RESOLUTION_M * math.hypot(row, column)
            if away_m <= within_m:
                yield around[reach + row :, reach + column :][: heights_m.shape[0], : heights_m.shape[1]], away_m


def about(means_m: Grid, sigmas_m: Grid) -> tuple[Grid, Grid]:
    """Heights and sigmas of cells that are known, or lie among such: weighed means of those about; else NaN.

    The heights over the hill are what is weighed: beside a slope's lowest cell it goes on downwards.
    """
    known, hills_m = np.isfinite(means_m), _hills(means_m)
    over_m = means_m - hills_m
    weight, total, squares = (_blurred(values, known, AMONG_M) for values in (1.0, over_m, sigmas_m**2 + over_m**2))
    weight = np.where(weight >= AMONG, weight, np.nan)
    mean = total / weight
    spread_m2 = squares / weight - mean**2
    return mean + hills_m, np.sqrt(np.maximum(spread_m2, 0.0))


def spread(means_m: Grid) -> Grid:
    """Heights of all cells: known ones, and between them the mean of those about; far from all of them NaN."""
    known = np.isfinite(means_m)
    weight, total = (_blurred(values, known, REACH_M) for values in (1.0, means_m))
    about = np.where(weight > LEAST_WEIGHT, total / np.maximum(weight, LEAST_WEIGHT), np.nan)
    return np.where(known, means_m, about)
