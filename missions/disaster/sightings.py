"""Where one frame says that a region is: the middle of its box, placed by that frame alone, as the paper does.

The mission locates a region by all frames (`regions.py`). The paper's figures are of single ones: three frames in a row
detect, and equations 1 to 3 place the box (its section 2.3). So that the two can be compared, what one frame of the
scan says is told, too, by the same `location`: once of each region, from the first frame after it was confirmed that
has all of its box. Nothing is decided by it.

Which box is a region's: the nearest that is as wide and high as the region, as mapped by then, appears in the picture
(`LEAST_IOU` of the two, laid over one another, so that nothing is asked of where it lies). A box of one slab of a ruin
says nothing of the ruin's middle.

Heights: the equations have one h, the camera's height above the ground under it, as ground is planar to them; a ray
ends at the ground's height where it meets it. Both take it from the map of the terrain, where sightings are placed by
one (`Relief`), else it is home's.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sitl_emu.missions.companion import planar_projection
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.geolocation import on_level_ground, pixel_ray
from sitl_emu.missions.disaster.regions import EDGE_PX, GAP_M, PROJECTIONS, RESOLUTION_M, Grid, Region, RegionMap

NEAR_M = 2.0 * GAP_M
"""A box's middle lies so near to its region: by one frame the equations are off by metres; ours."""
LEAST_IOU = 0.5
"""From which on a detection is one of a target: the paper's Table 4."""
STEPS = 3
"""In which a ray's end is found on ground that is not level; ours."""


class Sighting(NamedTuple):
    """The middle of a box, in metres north and east of the map's origin; `score` is the detector's."""

    label: str
    score: float
    place_m: Corner


class Sightings:
    """Of one flight: which regions were told already."""

    def __init__(self, camera: CameraModel, location: str) -> None:
        """`location`: one of `regions.PROJECTIONS`."""
        self._camera, self._location = camera, location
        self._told: list[Region] = []

    def new(
        self, pose: CameraPose, boxes: Sequence[Detection], regions: RegionMap, ground_m: Grid | float
    ) -> list[Sighting]:
        """What a frame says of regions that nothing was told of yet. `ground_m`: heights of the map's cells."""
        whole = [one for one in boxes if is_whole(one, self._camera)]
        open_ = [region for region in regions.regions() if not self._is_told(region)] if whole else []
        found = []
        for box in sorted(whole, key=lambda one: one.score, reverse=True):
            place_m = located(self._camera, pose, box, regions, ground_m, self._location)
            if place_m is None:
                continue
            away = [
                (_away_m(regions, one, place_m), i)
                for i, one in enumerate(open_)
                if one.label == box.label and self._is_as_large(box, pose, one, regions, ground_m)
            ]
            away_m, nearest = min(away, default=(math.inf, 0))
            if away_m < NEAR_M:
                self._told.append(open_.pop(nearest))
                found.append(Sighting(box.label, box.score, place_m))
        return found

    def _is_as_large(
        self, box: Detection, pose: CameraPose, region: Region, regions: RegionMap, ground_m: Grid | float
    ) -> bool:
        half_m = np.array(((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))).T[..., None] * RESOLUTION_M
        north_m, east_m = regions.north_m[region.cells] + half_m[0], regions.east_m[region.cells] + half_m[1]
        height_m = np.broadcast_to(np.broadcast_to(ground_m, regions.shape)[region.cells], north_m.shape)
        x, y = PROJECTIONS[self._location](self._camera, pose, north_m, east_m, height_m)
        wide, high = float(np.ptp(x)), float(np.ptp(y))
        both = min(wide, box.w) * min(high, box.h)
        return both >= LEAST_IOU * (wide * high + box.w * box.h - both)

    def _is_told(self, region: Region) -> bool:
        return any(one.label == region.label and bool((one.cells & region.cells).any()) for one in self._told)


def located(
    camera: CameraModel, pose: CameraPose, box: Detection, regions: RegionMap, ground_m: Grid | float, location: str
) -> Corner | None:
    """Metres north and east at which the middle of a box lies by one frame; None where it is not on the ground.

    `ground_m`: heights of the map's cells, (rows, columns), or of all.
    """
    down_m = -_height_m(regions, ground_m, (float(pose.position_m[0]), float(pose.position_m[1])))
    if location == "equations":
        point = planar_projection.placed(camera, pose, box.x, box.y, down_m)
        return None if point is None else (point[0], point[1])
    ray, place_m = pixel_ray(camera, pose, box.x, box.y), None
    for _ in range(STEPS):
        point = on_level_ground(ray, down_m)
        if point is None:
            return None
        place_m = point[0], point[1]
        down_m = -_height_m(regions, ground_m, place_m)
    return place_m


def _height_m(regions: RegionMap, ground_m: Grid | float, place_m: Corner) -> float:
    """The ground's height at a place; home's beyond the map."""
    cell = regions.cell(*place_m)
    return 0.0 if cell is None else float(np.broadcast_to(ground_m, regions.shape)[cell])


def is_whole(box: Detection, camera: CameraModel) -> bool:
    """Whether a box ends within the picture, not at its edge."""
    across = abs(box.x - (camera.width - 1) / 2.0) + box.w / 2.0 < (camera.width - 1) / 2.0 - EDGE_PX
    return across and abs(box.y - (camera.height - 1) / 2.0) + box.h / 2.0 < (camera.height - 1) / 2.0 - EDGE_PX


def _away_m(regions: RegionMap, region: Region, place_m: Corner) -> float:
    """How far a place is from the nearest cell of a region."""
    north, east = regions.north_m[region.cells] - place_m[0], regions.east_m[region.cells] - place_m[1]
    return float(np.hypot(north, east).min())
