"""The ground under a flight: mapped on the way (`companion/terrain`), used to place what is seen, and to fly over.

**What is flown at which height.** The scan flies at `scan_altitude_m`, where the lidar is blind, and the map comes from
corners' rays; the lidar adds take-off, each descent to a place, and the landing. With `altitude: terrain` the scan
keeps that height over the ground, and `CLEARANCE_M` over all that is mapped ahead, roofs too; else it keeps the height
above home. What is not mapped counts as home's height, with the option's `ground_sigma_m`; between mapped cells the
height is that of those about, weighed by their distance.

Sightings are placed on the ground (`companion/terrain/ground.py`), and it alone is kept as the terrain map, with slopes
that count from the hill they lie on (`ground_on_hills`), without the flight's own drift
(`companion/terrain/crossover.py`) and, between what was measured, as `about` has it; what is flown over are roofs and
trees as well.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import CameraModel, Sweep
from sitl_emu.missions.companion.terrain import files
from sitl_emu.missions.companion.terrain.features import Feature
from sitl_emu.missions.companion.terrain.following import Following, next_altitude
from sitl_emu.missions.companion.terrain.ground import about, ground, ground_on_hills, spread
from sitl_emu.missions.companion.terrain.survey import Survey
from sitl_emu.missions.companion.terrain.terrain_map import Bounds, TerrainMap
from sitl_emu.missions.disaster.places import Standing
from sitl_emu.missions.disaster.regions import RESOLUTION_M, Grid

EVERY_US = 1_000_000
STANDS_M = 1.0
"""What is mapped so high over the ground stands: a wall, a car, a tree; ours."""
UNDER_M = 2.0
"""What reaches no higher than so much under the vehicle, it may be over; ours: the heights of both are off."""
HOME_M = 3.0
"""What was sounded so near to home is its ground."""
CLEARANCE_M, SIGMAS = 10.0, 1.0
"""Over what is flown over, and what is added to its mapped height; ours."""
LATE_M = 0.5 * CLEARANCE_M
"""Nearer by so much than its clearance no roof is flown over: the vehicle stops before it and climbs; ours."""
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
            known = ground(self.survey.terrain.means_m(), RESOLUTION_M)
            self._heights_m = np.nan_to_num(spread(known, RESOLUTION_M))
            # a house that is flown over now is in no finished map yet
            now = self.survey.so_far()
            lowest = ground(now.means_m(), RESOLUTION_M, now.noises_m())
            rises_m = now.means_m() - np.nan_to_num(spread(lowest, RESOLUTION_M))
            self.stands = Standing(
                rises_m > STANDS_M, rises_m > max(self._tall_m, STANDS_M), np.asarray(np.isfinite(lowest))
            )
        return self._heights_m

    def ground_m(self, place_m: Corner) -> float:
        """The ground's height over home at a place, as sightings are placed by; home's where none is mapped about."""
        row, column = (int(at) for at in self.survey.terrain.cell(*place_m))
        rows, columns = self.survey.terrain.shape
        if isinstance(self._heights_m, float) or not (0 <= row < rows and 0 <= column < columns):
            return 0.0
        return float(self._heights_m[row, column])

    def at(self, place_m: Corner, unknown_sigma_m: float) -> tuple[float, float]:
        """The ground's height over home at a place, and one sigma of it."""
        height = self.survey.terrain.height_m(*place_m)
        if math.isfinite(height.mean_m):
            return height.mean_m, height.sigma_m
        return self.ground_m(place_m), unknown_sigma_m

    def standing_m(self, place_m: Corner) -> float:
        """Above home: the scan's height over the ground at a place, and no less than what is held on the line."""
        return max(self.held_m, self.ground_m(place_m) + self._scan_altitude_m)

    def clear_m(self) -> float:
        """Above home: what is clear of all that is mapped; 0 where nothing is."""
        terrain = self.survey.terrain
        highest = np.fmax.reduce(terrain.means_m() + SIGMAS * terrain.sigmas_m(), axis=None, initial=-CLEARANCE_M)
        return float(highest) + CLEARANCE_M

    def waypoint(
        self, here_m: Corner, to_m: Corner, speed_m_s: float, altitude_m: float, hold_m: float | None = None
    ) -> tuple[Corner, float]:
        """Where to fly next on the way to a place, and at which height above home, from `altitude_m` now.

        Straight on from here it leads through the height that is wanted `LEAD_M` ahead: the scan's over the farthest
        ground that is known till there, where none is the last one, and clear of what is mapped ahead. Where that can't
        be reached in time (`LATE_M`), straight up from here.

        `hold_m`: above home, to be kept instead of the scan's height over the ground, and come to in the end.
        """
        left_m, course = math.dist(here_m, to_m), math.atan2(to_m[1] - here_m[1], to_m[0] - here_m[0])
        lead_m = min(LEAD_M, left_m)
        terrain = self.survey.so_far()
        ground_m = _farthest(terrain, here_m, course, lead_m)
        if hold_m is None and math.isfinite(ground_m):
            self.held_m = ground_m + self._scan_altitude_m
        kept_m = self.held_m if hold_m is None else hold_m
        lead_s = lead_m / max(speed_m_s, SLOWEST_M_S)
        asked = [
            next_altitude(terrain, place_m, course, speed_m_s, altitude_m, lead_s, self._following, kept_m)
            for place_m in (here_m, _along(here_m, course, lead_m))
        ]
        highest = max(asked, key=lambda one: one.late_m)
        if highest.late_m > LATE_M:
            return here_m, highest.wanted_m
        soon_m = max(one.altitude_m for one in asked)
        if left_m <= lead_m:
            return to_m, soon_m if hold_m is None else max(one.wanted_m for one in asked)
        carrot_m = min(CARROT_M, left_m)
        return _along(here_m, course, carrot_m), altitude_m + (soon_m - altitude_m) * carrot_m / lead_m

    def write(self, path: Path, home: tuple[float, float, float]) -> float:
        """The ground as GeoTIFF; how high over `home` the ground there is by the lidar, 0 if it told nothing there.

        Raises OSError.
        """
        self.survey.finish()
        terrain, soundings = self.survey.adjusted()
        kept_m = ground_on_hills(terrain.means_m(), RESOLUTION_M)
        files.write_geotiff(path, terrain, *home, about(kept_m, terrain.sigmas_m(), RESOLUTION_M))
        at_home = [one.height_m for one in soundings if math.hypot(one.north_m, one.east_m) <= HOME_M]
        return float(np.median(at_home)) if at_home else 0.0


def _along(from_m: Corner, course_rad: float, by_m: float) -> Corner:
    return from_m[0] + by_m * math.cos(course_rad), from_m[1] + by_m * math.sin(course_rad)


def _farthest(terrain: TerrainMap, here_m: Corner, course_rad: float, within_m: float) -> float:
    """The height of the farthest ground that is known on a course, or lies among such; NaN where there is none."""
    heights_m = spread(ground(terrain.means_m(), RESOLUTION_M, terrain.noises_m()), RESOLUTION_M)
    for away_m in np.arange(within_m, -RESOLUTION_M, -RESOLUTION_M).tolist():
        row, column = (int(at) for at in terrain.cell(*_along(here_m, course_rad, away_m)))
        inside = 0 <= row < terrain.shape[0] and 0 <= column < terrain.shape[1]
        if inside and math.isfinite(heights_m[row, column]):
            return float(heights_m[row, column])
    return math.nan
