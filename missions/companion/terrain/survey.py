"""A terrain map in the making: a lidar's ranges where the vehicle is low, rays of followed corners where it is high.

A TF-Luna sees 8 m: it tells of take-off, landing and what is flown below that. From a scan's height the camera tells:
each corner that is followed is seen from places metres apart, and its rays cross at it (`crossings.py`).
A corner's height is taken once, when its rays have crossed at `CROSSED_DEG`, or at `LEAST_DEG` when it is lost; not
where the rays pass by each other wider than their noise says, as those of what moves do.

In flight the map has heights as they were told; `so_far` has those of corners that are still followed, too: by the time
a corner's height is taken it lies behind. `adjusted` is the map without the drift of the vehicle's own height, which
the whole flight tells (`crossover.py`).
"""

import math
from collections.abc import Sequence

import numpy as np

from sitl_emu.missions.companion.camera_model import CameraModel, FloatArray, Point, Quaternion, Sweep
from sitl_emu.missions.companion.geolocation import RAY_SIGMA_RAD, Covariance
from sitl_emu.missions.companion.terrain import crossover
from sitl_emu.missions.companion.terrain.crossings import Crossings, none_yet
from sitl_emu.missions.companion.terrain.features import Feature
from sitl_emu.missions.companion.terrain.soundings import TF_LUNA, Beam, Sounding, believed, of_feature, of_range
from sitl_emu.missions.companion.terrain.terrain_map import Bounds, TerrainMap

CROSSED_DEG, LEAST_DEG, FOLLOWED_DEG = 45.0, 25.0, 15.0
"""When a corner's height is taken; when it is lost; and while it is followed, for `so_far`. Ours."""
PASSES_SIGMAS = 2.0
"""A corner whose rays pass by by more than so many sigmas of a ray moves, or was confused with another; ours."""
LEAST_RAYS = 5
MOST_SOUNDINGS = 20_000
"""Kept for `adjusted`: a flight of 25 min gives so many. Of more every second is kept, then every fourth, of the whole
flight alike; the map that is flown by has all of them. Ours."""
BATCH_US = 2_000_000
"""Ranges are sifted by their neighbours (`soundings.believed`): so many together."""


class Survey:
    """Takes corners and ranges, fills a `TerrainMap`. Metres NED from the caller's origin, at home's height."""

    def __init__(self, bounds: Bounds, camera: CameraModel, resolution_m: float = 1.0, beam: Beam = TF_LUNA) -> None:
        self.terrain, self._bounds = TerrainMap(bounds, resolution_m), bounds
        self._camera, self._beam = camera, beam
        self._open = none_yet()
        self._done: set[int] = set()
        self._ranges: list[Sounding] = []
        self.soundings: list[Sounding] = []
        """What the map holds, of long flights a part of it."""
        self._last: tuple[int, FloatArray, float, float] | None = None
        """Of the last frame: time, where it was taken from, eph and epv."""
        self._told, self._every = 0, 1
        self.features = self.ranges = 0
        """How many of each were believed."""

    def on_features(self, time_us: int, sweep: Sweep, features: Sequence[Feature], eph_m: float, epv_m: float) -> None:
        """A frame's corners, with the camera's poses while it was read, and what the receiver states of these."""
        open_ = [one for one in features if one.number not in self._done]
        numbers = np.array([one.number for one in open_], np.int64)
        lost = self._open.part(~np.isin(self._open.numbers, numbers))
        self._done &= {one.number for one in features}
        here_m = sweep.first.position_m
        made = self._soundings(lost, time_us, LEAST_DEG, here_m, eph_m, epv_m)
        rays = np.array([self._camera.ray(one.x, one.y) for one in open_]).reshape(-1, 3)
        shares = np.array([one.y / (self._camera.height - 1) for one in open_])
        self._open = self._open.with_rays(numbers, sweep.origins_m(shares), sweep.directions(rays, shares))
        crossed = self._soundings(self._open, time_us, CROSSED_DEG, here_m, eph_m, epv_m)
        self._done |= crossed.keys()
        self._open = self._open.part(~np.isin(self._open.numbers, list(crossed)))
        believed_now = [*made.values(), *crossed.values()]
        self.features += len(believed_now)
        self._take(sorted(believed_now))
        self._last = time_us, here_m, eph_m, epv_m

    def on_range(
        self, time_us: int, range_m: float, position_ned_m: Point, q: Quaternion, eph_m: float, epv_m: float
    ) -> None:
        """A range that the lidar measured, with the vehicle's pose of its moment."""
        sounding = of_range(self._beam, time_us, range_m, position_ned_m, q, eph_m, epv_m)
        if sounding is None:
            return
        if self._ranges and time_us - self._ranges[0].time_us > BATCH_US:
            self.finish()
        self._ranges.append(sounding)

    def finish(self) -> None:
        """Takes in what waits for its neighbours."""
        good = believed(self._ranges)
        self.ranges += len(good)
        self._take(good)
        self._ranges = []

    def so_far(self) -> TerrainMap:
        """The map, and the heights of corners that are still followed as they seem now."""
        terrain = TerrainMap(self._bounds, self.terrain.resolution_m)
        terrain.merge(self.terrain)
        if self._last is not None:
            time_us, here_m, eph_m, epv_m = self._last
            terrain.add(self._soundings(self._open, time_us, FOLLOWED_DEG, here_m, eph_m, epv_m).values())
        return terrain

    def adjusted(self) -> tuple[TerrainMap, list[Sounding]]:
        """The map without the drift of the vehicle's height, and the soundings that it then holds."""
        soundings = crossover.without(self.soundings, crossover.drift_of(self.soundings))
        terrain = TerrainMap(self._bounds, self.terrain.resolution_m)
        terrain.add(soundings)
        return terrain, soundings

    def _take(self, soundings: list[Sounding]) -> None:
        first = -self._told % self._every
        self._told += len(soundings)
        self.soundings += soundings[first :: self._every]
        while len(self.soundings) > MOST_SOUNDINGS:
            self.soundings, self._every = self.soundings[::2], 2 * self._every
        self.terrain.add(soundings)

    def _soundings(
        self, of: Crossings, time_us: int, least_deg: float, here_m: FloatArray, eph_m: float, epv_m: float
    ) -> dict[int, Sounding]:
        """The heights of corners whose rays have crossed, by their numbers; of none whose rays pass by each other."""
        of = of.part((of.counts >= LEAST_RAYS) & (of.cosines <= math.cos(math.radians(least_deg))))
        points = of.points()
        range_m = np.linalg.norm(points - here_m, axis=1)
        good = (of.residuals_m() <= PASSES_SIGMAS * RAY_SIGMA_RAD * range_m) & (points[:, 2] >= here_m[2])
        made = {}
        for number, (north, east, down), c in zip(
            of.numbers[good].tolist(), points[good].tolist(), of.covariances()[good].tolist(), strict=True
        ):
            rays = Covariance(c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2])
            sounding = of_feature(time_us, (north, east, down), rays, eph_m, epv_m)
            if sounding is not None:
                made[number] = sounding
        return made
