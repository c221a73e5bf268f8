"""How far one sees in haze, and in how many scans the ruin that is there is detected: where the paper's 80 % are.

    python tools/disaster/haze.py [--visibility-m N…] [--seeds FIRST LAST] [--height-m N]

Goes along the scan's lines at a fixed altitude over fields of debris with one ruin each (`disaster-debris`, over the
relief of the paper's Table 5), as the vehicle leans at the scan's speed, and looks where a picture may show the ruin.
Detected is a ruin whose whole box three frames in a row show. The first place that `engage: detections`
(`as_printed.py`) would fly to is the scan's call: any box counts, also one that the picture's edge cuts. Prints, for
each visibility, how many ruins are detected, how many calls are to the ruin, and how far off its middle the paper's
equations place these. Nothing is flown; what a flight calls to elsewhere comes on top. The seeds are none of those
that `paper_tables.py` flies.
"""

import argparse
import itertools
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from shapely import Point

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion import planar_projection
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, camera_pose
from sitl_emu.missions.companion.coverage import Line, footprint, lawnmower, polygon
from sitl_emu.missions.companion.detector import Detection, Detector
from sitl_emu.missions.disaster.as_printed import Locate, Runs
from sitl_emu.missions.disaster.detectors import CONFIRMING, network
from sitl_emu.missions.disaster.score import MATCH_M
from sitl_emu.missions.disaster.sightings import is_whole
from sitl_emu.missions.disaster.truth import targets
from sitl_emu.missions.scoring import TrueArea
from sitl_emu.run import worlds
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.conditions import Changes, LightChange
from sitl_emu.world.labels.geojson import footprint as outline
from sitl_emu.world.lens import Intrinsics
from sitl_emu.world.world import World

FIELD = {"size_m": 100, "relief_m": 6, "ruins": 1}
"""The scenario's, with the relief of the paper's Table 5."""
OVERLAP, MARGIN_M, STEP_M, FRAME_US = 0.3, 6.0, 1.0, 200_000
"""The scenario's; 5 m/s, five pictures a second."""
LEAN_RAD = math.radians(5.8)
"""Of the vehicle at 5 m/s, median (docs/disaster-measured.md)."""
CAMERA, LENS = CameraModel(), Intrinsics()


class Call(NamedTuple):
    """To a place."""

    is_ruin: bool
    """By the rule of the mission's score: a box of ruins, within `MATCH_M` of the true one."""
    error_m: float
    """From the middle of the ruin's bounds."""


class Scan(NamedTuple):
    """What a scan of a field comes to."""

    detected: bool
    call: Call | None


def main() -> None:
    """Prints a row for each visibility."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--visibility-m", type=float, nargs="+", default=[180, 220, 260], metavar="N",
                        help="where a twentieth of a light is left (180 220 260)")  # fmt: skip
    parser.add_argument("--seeds", type=int, nargs=2, default=(201, 240), metavar=("FIRST", "LAST"))
    parser.add_argument("--height-m", type=float, default=20.0, metavar="N", help="above home (20)")
    given = parser.parse_args()
    first, last = given.seeds
    detector = network()
    print("visibility, m; detected, of all; called to the ruin; within 5 m of its middle; RMSE, m; called to nothing")
    for visibility_m in given.visibility_m:
        changes = Changes(None, LightChange(visibility_m=visibility_m))
        fields = (worlds.build("debris_field", seed, FIELD, changes) for seed in range(first, last + 1))
        scans = [scanned(field, detector, given.height_m) for field in fields]
        detected, calls = sum(scan.detected for scan in scans), [scan.call for scan in scans if scan.call is not None]
        errors_m = [call.error_m for call in calls if call.is_ruin]
        near = sum(error_m <= MATCH_M for error_m in errors_m)
        rmse_m = math.sqrt(math.fsum(each**2 for each in errors_m) / len(errors_m)) if errors_m else math.nan
        counts = f"{detected:4} of {len(scans)} {len(errors_m):4} {near:4} {rmse_m:6.2f} {len(calls) - len(errors_m):4}"
        print(f"{visibility_m:6.0f} {counts}", flush=True)


def scanned(field: World, detector: Detector, height_m: float) -> Scan:
    """A scan of a field."""
    home = field.places["home"]
    camera, runs, whole_runs = Camera(field.scene(), intrinsics=LENS, name="uas"), Runs(CONFIRMING), Runs(CONFIRMING)
    home_m = field.ground(home.north_m, home.east_m)
    solids = field.description.solids
    areas = [TrueArea("solid", solid.name, solid.label, outline(solid, field)) for solid in solids]
    ruin = next(one for one in targets(areas, 0.0) if one.label == "debris_field")
    middle = ruin.shape.envelope.centroid
    lines = lawnmower(polygon(field.description.area_m), footprint(CAMERA, height_m), OVERLAP, margin_m=MARGIN_M,
                      start_m=(home.north_m, home.east_m))  # fmt: skip

    def is_ruin(box: Detection, place_m: Corner) -> bool:
        return box.label == ruin.label and bool(ruin.shape.distance(Point(place_m)) <= MATCH_M)

    detected, call = False, None
    for number, pose in enumerate(_poses(lines, home_m + height_m)):
        if ruin.shape.distance(Point(pose.north_m, pose.east_m)) > height_m * LENS.width / 2.0 / CAMERA.focal_px:
            continue
        over_ground_m = -pose.down_m - field.ground(pose.north_m, pose.east_m)
        boxes = detector.detect(camera.render(pose, number * FRAME_US), over_ground_m / CAMERA.focal_px)
        locate = _by_equations(pose, -home_m)
        whole = whole_runs.update([box for box in boxes if is_whole(box, CAMERA)], locate)
        detected = detected or any(itertools.starmap(is_ruin, whole))
        for box, place_m in runs.update(boxes, locate):
            call = call or Call(is_ruin(box, place_m), math.dist(place_m, (middle.x, middle.y)))
        if detected and call is not None:
            break
    return Scan(detected, call)


def _poses(lines: Sequence[Line], altitude_m: float) -> Iterator[Pose]:
    """Along lines, nose ahead and down."""
    for (north_m, east_m), end_m in lines:
        heading_rad = math.atan2(end_m[1] - east_m, end_m[0] - north_m)
        q = quaternion(0.0, -LEAN_RAD, heading_rad)
        for step in range(int(math.dist((north_m, east_m), end_m) / STEP_M) + 1):
            ahead_m = STEP_M * step
            place_m = north_m + ahead_m * math.cos(heading_rad), east_m + ahead_m * math.sin(heading_rad)
            yield Pose(*place_m, -altitude_m, q)


def _by_equations(pose: Pose, ground_down_m: float) -> Locate:
    """Where equations 1 to 3 place the middle of a box that is seen from a pose."""
    seen_from = camera_pose((pose.north_m, pose.east_m, pose.down_m), pose.q, NADIR)

    def locate(box: Detection) -> Corner | None:
        point = planar_projection.placed(CAMERA, seen_from, box.x, box.y, ground_down_m)
        return None if point is None else (point[0], point[1])

    return locate


if __name__ == "__main__":
    main()
