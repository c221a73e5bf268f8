"""What the network `disaster` makes of a flood's shore: the share of water that it sees, by how deep that is.

    python tools/disaster/shallows.py [--seeds N…] [--looks N]

Looks straight down at the shores of scenario `disaster`'s towns from its scan's and its release's height, and between.
A parcel is to lie on dry ground beside them; `missions/disaster/places.py` goes by shares (`DOUBT`, `LOW_DOUBT`).
"""

import argparse
import itertools
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from sitl_emu.missions.companion.detector import Detections
from sitl_emu.missions.disaster.detectors import network
from sitl_emu.missions.disaster.places import DOUBT, LOW_DOUBT
from sitl_emu.missions.disaster.regions import LEAST_SHARE
from sitl_emu.run import worlds
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.lens import NADIR, Intrinsics
from sitl_emu.world.world import World

Floats = npt.NDArray[np.float64]
HEIGHTS_M = (24.0, 12.0, 7.5)
"""Above the ground."""
DEPTHS_M = (-1.0, -0.3, -0.1, -0.05, -0.02, 0.0, 0.02, 0.04, 0.06, 0.1, 0.2, 0.5)
"""Edges of the table's rows; below 0: of ground above the water."""
SHARES = (LEAST_SHARE, DOUBT, LOW_DOUBT)
NEAR_SHORE_M = 0.25
"""How far above or below the water the ground in a picture's middle may lie."""
STEP_PX, MARGIN_PX = 12, 20
"""Between pixels that are asked for, and from the picture's edge."""
ON_GROUND_M = 0.15
SIZE_M = 100.0
"""Of the towns, as in the scenario."""
CAMERA = Intrinsics(640, 480)


class Look(NamedTuple):
    """At one pixel."""

    depth_m: float
    share: float


def main() -> None:
    """Prints a table for each height."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], metavar="N", help="of towns (1 2 3)")
    parser.add_argument("--looks", type=int, default=25, metavar="N", help="pictures of each town and height (25)")
    given = parser.parse_args()
    towns = [worlds.build("urban_flood", seed, {"size_m": SIZE_M}) for seed in given.seeds]
    for height_m in HEIGHTS_M:
        looks = np.array([look for town in towns for look in _looks(town, height_m, given.looks)])
        print(
            f"\nfrom {height_m:g} m: water's depth, m; pixels; mean share; "
            f"of them at {', '.join(f'{share:g}' for share in SHARES)} or more",
            flush=True,
        )
        for low, high in itertools.pairwise(DEPTHS_M):
            shares = looks[(looks[:, 0] >= low) & (looks[:, 0] < high), 1]
            if len(shares):
                parts = " ".join(f"{np.mean(shares >= least):5.2f}" for least in SHARES)
                print(f"{low:6.2f} to {high:5.2f} {len(shares):7} {shares.mean():5.2f} {parts}", flush=True)


def _looks(town: World, height_m: float, count: int) -> Iterator[Look]:
    """Pixels of so many pictures of a town's shores that show ground or water."""
    camera, detector = Camera(town.scene(), NADIR, CAMERA, "uas"), network()
    (flood,) = town.description.water
    rng = np.random.default_rng(town.description.seed)
    columns, rows = (np.arange(MARGIN_PX, side - MARGIN_PX, STEP_PX) for side in (CAMERA.width, CAMERA.height))
    x, y = (axis.ravel().astype(float) for axis in np.meshgrid(columns, rows))
    taken = 0
    while taken < count:
        north, east = rng.uniform(0.0, SIZE_M, 2)
        ground_m, heading_rad = town.ground(north, east), rng.uniform(-math.pi, math.pi)
        if abs(flood.level_m - ground_m) > NEAR_SHORE_M:
            continue
        taken += 1
        q = math.cos(heading_rad / 2.0), 0.0, 0.0, math.sin(heading_rad / 2.0)
        pose = Pose(north, east, -(ground_m + height_m), q)
        found = detector.detect(camera.render(pose, 1_000_000 * taken), height_m / CAMERA.focal_px)
        assert isinstance(found, Detections) and found.areas is not None
        shares = found.areas.at("water_body", x, y)
        for place, share in zip(_places(town, pose, heading_rad, x, y), shares.tolist(), strict=True):
            terrain_m = town.ground(place[0], place[1])
            if abs(-place[2] - terrain_m) < ON_GROUND_M or abs(-place[2] - flood.level_m) < ON_GROUND_M:
                yield Look(flood.level_m - terrain_m, share)


def _places(town: World, pose: Pose, heading_rad: float, x: Floats, y: Floats) -> Floats:
    """(n, 3), NED: where the rays of pixels end."""
    right, ahead = (x - CAMERA.width / 2.0) / CAMERA.focal_px, -(y - CAMERA.height / 2.0) / CAMERA.focal_px
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    ways = np.stack((cos * ahead - sin * right, sin * ahead + cos * right, np.ones_like(right)), axis=1)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    eye = np.array((pose.north_m, pose.east_m, pose.down_m))
    met = town.raycast(np.repeat(eye[None], len(ways), axis=0), ways, 0.0, 200.0)
    return np.asarray(eye + ways * np.where(np.isfinite(met.range_m), met.range_m, 0.0)[:, None])


if __name__ == "__main__":
    main()
