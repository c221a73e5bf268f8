"""Water and foliage of a world at work: where they lie, what rays meet of them, and what of it a laser hears.

Water is where the ground within its polygon lies below its level. Nobody stands on it.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.vehicles.dynamics import Vector3
from sitl_emu.world import foliage, polygons, rays
from sitl_emu.world.description import Cover, Water
from sitl_emu.world.ground import Terrain
from sitl_emu.world.terrain import HeightMap

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

SEEN_BY_LASER = ("crop", "canopy")
MIRRORS_BACK_COS = math.cos(math.radians(15.0))
"""How steep a laser beam must meet water to be heard again. Near infrared is absorbed in water, so only facets of the
surface that lie square to the beam send it back. Of the slopes of wind waves (Cox and Munk, Measurement of the
roughness of the sea surface, 1954: mean square 0.003 + 0.00512 U, at U = 5 m/s 0.029) a twelfth as many lie at 15
degrees as at none (exp(-tan² 15° / 0.029)). That this is where a range finder loses it is ours."""


SHORE_M = 0.5
"""How closely a shore is drawn."""


class Shore(NamedTuple):
    """Where one body of water ends."""

    outline_m: tuple[tuple[float, float], ...]
    islands_m: tuple[tuple[tuple[float, float], ...], ...] = ()


class WaterAndFoliage:
    """All water and foliage of one world."""

    def __init__(self, water: Sequence[Water], cover: Sequence[Cover], terrain: Terrain) -> None:
        self.water = tuple(water)
        self._terrain = terrain
        self._foliage = [(each, foliage.box_of(each, terrain)) for each in cover if each.kind in SEEN_BY_LASER]
        self._highest_m = max((each.level_m for each in water), default=-math.inf)

    def water_at(self, north_m: float, east_m: float, down_m: float) -> Water | None:
        """The water in which a place lies; None: it is dry."""
        if -down_m >= self._highest_m:
            return None
        found = [each for each in self.water if -down_m < each.level_m and self._wet(each, north_m, east_m)]
        return max(found, key=lambda each: each.level_m, default=None)

    def rays(
        self, origins: FloatArray, directions: FloatArray, reach: FloatArray
    ) -> list[tuple[FloatArray, Water | Cover]]:
        """Ranges (n,) at which rays (n, 3; NED) meet each of them within their `reach` (n,), inf where they do not."""
        return self._met(self._foliage, origins, directions, reach)

    def heard(self, origin: Vector3, direction: Vector3, range_m: float, reach_m: float) -> float:
        """How far (m) a laser range finder measures along a beam that meets ground or a solid at `range_m`.

        `reach_m`: how far it can hear. inf: nothing comes back, since water mirrors the beam away.
        """
        least_m = min(range_m, reach_m)
        near = [one for one in self._foliage if foliage.may_meet(one[1], origin, direction, least_m)]
        nearest, what = range_m, None
        for ranges, each in self._met(near, np.array([origin]), np.array([direction]), np.array([least_m])):
            if ranges[0] < nearest:
                nearest, what = float(ranges[0]), each
        return math.inf if isinstance(what, Water) and direction[2] < MIRRORS_BACK_COS else nearest

    def mirrored(self, names: Sequence[str], directions: FloatArray) -> BoolArray:
        """Which of many rays (n, 3) that met these (n) are lost to a laser: those that meet water too slanted."""
        wet = {water.name for water in self.water}
        return np.array([name in wet for name in names]) & (directions[:, 2] < MIRRORS_BACK_COS)

    def shores(self, water: Water) -> list[Shore]:
        """The lines to which one of them reaches, a shore for each body of water, to SHORE_M or a thousandth of it."""
        if not isinstance(self._terrain, HeightMap):
            return [Shore(water.polygon_m)] if self._terrain.height_m(0.0, 0.0) < water.level_m else []
        corners = np.array(water.polygon_m)
        low, high = corners.min(axis=0), corners.max(axis=0)
        step = max(SHORE_M, float((high - low).max()) / 1000.0)
        north, east = np.meshgrid(
            *(np.arange(one, other, step) for one, other in zip(low, high, strict=True)), indexing="ij"
        )
        wet = polygons.inside(water.polygon_m, north, east) & (self._terrain.heights_m(north, east) < water.level_m)
        lines, tree = cv2.findContours(wet.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
        if not len(lines):
            return []
        drawn = [low + step * cv2.approxPolyDP(line, 1.0, True)[:, 0, ::-1] for line in lines]
        found = [tuple((float(n), float(e)) for n, e in line) for line in drawn]
        kept = [len(line) >= 3 for line in found]
        return [
            Shore(found[at], tuple(found[hole] for hole in range(len(found)) if kept[hole] and tree[0][hole][3] == at))
            for at in range(len(found))
            if kept[at] and tree[0][at][3] < 0
        ]

    def _wet(self, water: Water, north_m: float, east_m: float) -> bool:
        ground_m = self._terrain.height_m(north_m, east_m)
        return ground_m < water.level_m and polygons.contains(water.polygon_m, north_m, east_m)

    def _met(
        self,
        leaves: Sequence[tuple[Cover, foliage.Box]],
        origins: FloatArray,
        directions: FloatArray,
        reach: FloatArray,
    ) -> list[tuple[FloatArray, Water | Cover]]:
        met: list[tuple[FloatArray, Water | Cover]] = [
            (self._meet_water(each, origins, directions, reach), each) for each in self.water
        ]
        met += [(foliage.meet(each, box, self._terrain, origins, directions, reach), each) for each, box in leaves]
        return met

    def _meet_water(self, water: Water, origins: FloatArray, directions: FloatArray, reach: FloatArray) -> FloatArray:
        with np.errstate(divide="ignore", invalid="ignore"):
            ranges = (-water.level_m - origins[:, 2]) / directions[:, 2]
        ranges[~((directions[:, 2] > 0.0) & (ranges >= 0.0) & (ranges <= reach))] = np.inf
        met = np.flatnonzero(np.isfinite(ranges))
        north, east = (origins[met] + ranges[met, None] * directions[met])[:, :2].T
        dry = ~polygons.inside(water.polygon_m, north, east)
        dry |= rays.heights(self._terrain, north, east) >= water.level_m
        ranges[met[dry]] = np.inf
        return ranges
