"""A terrain map in the making: a lidar's ranges where the vehicle is low, rays of followed corners where it is high.

A TF-Luna sees 8 m: it tells of take-off, landing and what is flown below that. From a scan's height the camera tells:
each corner that is followed is seen from places metres apart, and its rays cross at it (`geolocation.Intersection`).
A corner's height is taken once, when its rays have crossed at `CROSSED_DEG`, or at `LEAST_DEG` when it is lost; not
where the rays pass by each other wider than their noise says, as those of what moves do.
"""

import math
from collections.abc import Sequence

from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose, Point, Quaternion
from sitl_emu.missions.companion.geolocation import RAY_SIGMA_RAD, Intersection, pixel_ray
from sitl_emu.missions.companion.terrain.features import Feature
from sitl_emu.missions.companion.terrain.soundings import TF_LUNA, Beam, Sounding, believed, of_feature, of_range
from sitl_emu.missions.companion.terrain.terrain_map import Bounds, TerrainMap

CROSSED_DEG, LEAST_DEG = 45.0, 25.0
PASSES_SIGMAS = 2.0
"""A corner whose rays pass by by more than so many sigmas of a ray moves, or was confused with another; ours."""
LEAST_RAYS = 5
BATCH_US = 2_000_000
"""Ranges are sifted by their neighbours (`soundings.believed`): so many together."""


class Survey:
    """Takes corners and ranges, fills a `TerrainMap`. Metres NED from the caller's origin, at home's height."""

    def __init__(self, bounds: Bounds, camera: CameraModel, resolution_m: float = 1.0, beam: Beam = TF_LUNA) -> None:
        self.terrain = TerrainMap(bounds, resolution_m)
        self._camera, self._beam = camera, beam
        self._open: dict[int, Intersection] = {}
        self._done: set[int] = set()
        self._ranges: list[Sounding] = []
        self.features = self.ranges = 0
        """How many of each were believed."""

    def on_features(
        self, time_us: int, pose: CameraPose, features: Sequence[Feature], eph_m: float, epv_m: float
    ) -> None:
        """A frame's corners, at the camera's pose, with what the receiver states of that."""
        numbers = {one.number for one in features}
        made = [self._sounding(number, time_us, LEAST_DEG, pose, eph_m, epv_m) for number in set(self._open) - numbers]
        for number in set(self._open) - numbers:
            del self._open[number]
        self._done &= numbers
        for one in features:
            if one.number in self._done:
                continue
            place = self._open.setdefault(one.number, Intersection(0.0))
            place.add(pixel_ray(self._camera, pose, one.x, one.y), 0.0)
            sounding = self._sounding(one.number, time_us, CROSSED_DEG, pose, eph_m, epv_m)
            if sounding is not None:
                made.append(sounding)
                self._done.add(one.number)
                del self._open[one.number]
        believed_now = [one for one in made if one is not None]
        self.features += len(believed_now)
        self.terrain.add(sorted(believed_now))

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
        self.terrain.add(good)
        self._ranges = []

    def _sounding(
        self, number: int, time_us: int, least_deg: float, pose: CameraPose, eph_m: float, epv_m: float
    ) -> Sounding | None:
        """The height of a corner whose rays have crossed; None where they have not, or pass by each other."""
        place = self._open[number]
        if place.count < LEAST_RAYS or place.spread_rad < math.radians(least_deg):
            return None
        point = place.point()
        range_m = math.dist(point, pose.position_m.tolist())
        if place.residual_m() > PASSES_SIGMAS * RAY_SIGMA_RAD * range_m or point[2] < float(pose.position_m[2]):
            return None
        return of_feature(time_us, point, place.covariance(), eph_m, epv_m)
