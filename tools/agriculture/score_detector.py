"""Scores detector, geolocation and confirmation over fields, without autopilot or links.

    python tools/agriculture/score_detector.py [--seeds 1:11] [--height 15] [--spacing 12] [--every 1]
                                               [--size 80 80] [--mast] [--white-balance RED BLUE] [--jpeg QUALITY]
                                               [--detector NAME|FILE.onnx] [--report-score S] [--confirm-score S]

A camera is carried along the lines of a survey at 5 m/s and 15 frames a second (`--every 3`: each third frame), with
wandering roll and pitch; the pose the companion believes is off by a slow GPS error (0.5 m), a barometer's, and errors
of attitude (0.7 degrees) and heading (1.5). Counted as a run's score counts (`missions/agriculture/score.py`): a target
is found when it is reported with its label; wrong labels, second reports, and reports of nothing are counted apart.
Printed for each seed with geolocation error and CPU per frame. `--mast`: the rover's look at each object instead.
`--white-balance` and `--jpeg` change the pictures before the detector sees them: factors of red and blue, and a
compression with that quality.
Exits 1 if fewer than 90 % are found, more than one in ten fields has a false or wrong one, or the RMSE exceeds 1.5 m.

Measured: `missions/companion/networks/field.md`.
"""

import argparse
import math
import sys
import time
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.agriculture.detectors import FROM_THE_AIR, FROM_THE_MAST
from sitl_emu.missions.companion import camera_model, confirmation
from sitl_emu.missions.companion.camera_model import CameraModel, camera_pose
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.perception import Perception, perception_of
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.kinds.corn_field import field as corn_field
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.lens import MAST, NADIR
from sitl_emu.world.noise import GaussMarkov

Image = npt.NDArray[np.uint8]

MATCH_M = 2.5
SPEED_M_S, RATE_HZ = 5.0, 15.0


class Score(NamedTuple):
    """What one field gave."""

    targets: int
    found: int
    """Of them, those reported with their label."""
    wrong: list[str]
    twice: int
    false: list[str]
    missed: list[str]
    errors_m: list[float]
    render_ms: float = 0.0
    detect_ms: float = 0.0
    frames: int = 0


class Change(NamedTuple):
    """What becomes of a picture between the camera and the detector."""

    red: float = 1.0
    blue: float = 1.0
    jpeg: int | None = None

    def __call__(self, image: Image) -> Image:
        """The BGR picture as the detector sees it."""
        if (self.red, self.blue) != (1.0, 1.0):
            gains = np.array((self.blue, 1.0, self.red), np.float32)
            image = np.clip(image * gains + 0.5, 0.0, 255.0).astype(np.uint8)
        if self.jpeg is not None:
            _, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, self.jpeg])
            image = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)
        return image


def survey(size_m: tuple[float, float], spacing_m: float, step_m: float) -> list[tuple[float, float, float]]:
    """(north, east, yaw) along north-south lines over the field, turns left out."""
    lines = math.ceil(size_m[1] / spacing_m)
    gap = size_m[1] / lines
    path = []
    for i in range(lines):
        north = np.arange(0.0, size_m[0], step_m)
        up = i % 2 == 0
        path += [(float(n), gap * (i + 0.5), 0.0 if up else math.pi) for n in (north if up else north[::-1])]
    return path


def score(
    seed: int,
    seeing: Perception,
    height_m: float,
    spacing_m: float,
    every: int,
    size_m: tuple[float, float],
    change: Change,
    verbose: bool,
) -> Score:
    """One field, flown once."""
    field = corn_field.build(seed, size_m)
    camera, detector = Camera(FieldScene(field), NADIR), seeing.detector
    rng = np.random.Generator(np.random.PCG64([seed, 77]))

    def draw() -> float:
        return float(rng.normal())

    dt = every / RATE_HZ
    roll, pitch = GaussMarkov(0.045, 1.0, dt, draw), GaussMarkov(0.045, 1.0, dt, draw)
    gps_north, gps_east = GaussMarkov(0.35, 60.0, dt, draw), GaussMarkov(0.35, 60.0, dt, draw)
    baro = GaussMarkov(0.4, 60.0, dt, draw)
    off = [GaussMarkov(math.radians(s), 5.0, dt, draw) for s in (0.7, 0.7, 1.5)]
    model = CameraModel()
    tracker = confirmation.Confirmation(
        model, 0.0, seeing.confirming, inside=lambda north, east: 0.0 <= north <= size_m[0] and 0.0 <= east <= size_m[1]
    )
    render_s = detect_s = 0.0
    path = survey(size_m, spacing_m, SPEED_M_S * dt)
    for i, (north, east, yaw) in enumerate(path):
        time_us = round(i * dt * 1e6)
        true = (roll.step(), pitch.step() - 0.05, yaw)
        believed = tuple(t + o.step() for t, o in zip(true, off, strict=True))
        t0 = time.thread_time()
        image = camera.render(Pose(north, east, -height_m, quaternion(*true)), time_us)
        t1 = time.thread_time()
        detections = detector.detect(change(image), height_m / model.focal_px)
        render_s, detect_s = render_s + t1 - t0, detect_s + time.thread_time() - t1
        place = (north + gps_north.step(), east + gps_east.step(), -height_m + baro.step())
        pose = camera_pose(place, quaternion(believed[0], believed[1], believed[2]), camera_model.NADIR)
        tracker.update(time_us, pose, detections)
    tracker.finish()
    render_ms, detect_ms = render_s / len(path) * 1e3, detect_s / len(path) * 1e3
    return judged(field, tracker.targets, verbose)._replace(render_ms=render_ms, detect_ms=detect_ms, frames=len(path))


def judged(field: corn_field.CornField, reported: list[confirmation.Target], verbose: bool) -> Score:
    """What was reported, against the truth."""
    found: dict[int, confirmation.Target] = {}
    wrong, false, twice = list[str](), list[str](), 0
    for target in reported:
        place = (target.north_m, target.east_m)
        near = [i for i, t in enumerate(field.targets) if math.dist((t.north_m, t.east_m), place) <= MATCH_M]
        right = [i for i in near if field.targets[i].kind == target.label]
        if right:
            index = min(right, key=lambda i: math.dist((field.targets[i].north_m, field.targets[i].east_m), place))
            twice += index in found
            found.setdefault(index, target)
            continue
        nearest = min(field.objects, key=lambda o: math.dist((o.north_m, o.east_m), place))
        away = math.dist((nearest.north_m, nearest.east_m), place)
        told = f"{target.label} {target.score:.2f} x{target.sightings} {away:.1f} m from {nearest.kind}"
        (wrong if near else false).append(told)
    missed = [f"{t.kind} r{t.radius_m:.2f}" for i, t in enumerate(field.targets) if i not in found]
    errors = [math.dist((field.targets[i].north_m, field.targets[i].east_m), t[3:5]) for i, t in found.items()]
    for i, t in found.items() if verbose else ():
        print(f"    {field.targets[i].kind} r{field.targets[i].radius_m:.2f}: {t.label} {t.score:.2f} x{t.sightings}")
    return Score(len(field.targets), len(found), wrong, twice, false, missed, errors)


def inspect(seed: int, seeing: Perception, change: Change, verbose: bool) -> tuple[int, int, int, int]:
    """The rover's look: (targets looked at, confirmed with their label, distractors looked at, taken for a target).

    It stands about 1 m short of each, facing it within 15 degrees, and its camera takes 6 frames.
    """
    field = corn_field.build(seed)
    camera, detector, model = Camera(FieldScene(field), MAST), seeing.detector, CameraModel()
    rng = np.random.Generator(np.random.PCG64([seed, 78]))
    counts = {True: [0, 0], False: [0, 0]}
    for thing in field.objects:
        yaw, ahead = rng.uniform(0.0, math.tau), rng.uniform(0.6, 1.8)
        north, east = thing.north_m - ahead * math.cos(yaw), thing.east_m - ahead * math.sin(yaw)
        ground = -field.terrain.height_m(north, east)
        heading = yaw + rng.uniform(-0.26, 0.26)
        tracker = confirmation.Confirmation(model, ground, seeing.confirming)
        seen = []
        for i in range(6):
            q = quaternion(float(rng.normal(scale=0.02)), float(rng.normal(scale=0.02)), heading)
            image = camera.render(Pose(north, east, ground - 0.2, q), i * 66_667)
            pose = camera_pose((north, east, ground - 0.2), q, camera_model.MAST)
            gsd = camera_model.gsd_m(model, pose, ground)
            tracker.update(i * 66_667, pose, detector.detect(change(image), gsd))
        for target in tracker.targets:
            if math.hypot(target.north_m - thing.north_m, target.east_m - thing.east_m) < 1.5:
                seen.append(f"{target.label} {target.score:.2f}")
        taken = any(one.startswith(thing.kind) for one in seen) if thing.is_target else bool(seen)
        counts[thing.is_target][0] += 1
        counts[thing.is_target][1] += taken
        if verbose and taken != thing.is_target:
            print(f"    {thing.kind} r{thing.radius_m:.2f} from {ahead:.1f} m: {', '.join(seen) or 'nothing'}")
    return counts[True][0], counts[True][1], counts[False][0], counts[False][1]


def score_mast(first: int, last: int, seeing: Perception, change: Change, verbose: bool) -> int:
    """All fields from the rover's mast."""
    rows = [inspect(seed, seeing, change, verbose) for seed in range(first, last)]
    targets, confirmed, others, false = (sum(row[i] for row in rows) for i in range(4))
    print(f"from the mast: {confirmed}/{targets} targets confirmed, {false}/{others} distractors taken for one")
    return 0 if confirmed >= 0.9 * targets else 1


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", default="1:11", help="first:end, end left out")
    parser.add_argument("--height", type=float, default=15.0, help="above home, in metres")
    parser.add_argument("--spacing", type=float, default=12.0, help="between lines, in metres")
    parser.add_argument("--every", type=int, default=1, help="take each n-th frame")
    parser.add_argument("--size", type=float, nargs=2, default=corn_field.DEFAULT_SIZE_M)
    parser.add_argument("--mast", action="store_true", help="score the rover's look at each object instead")
    parser.add_argument("--white-balance", type=float, nargs=2, default=(1.0, 1.0), metavar=("RED", "BLUE"))
    parser.add_argument("--jpeg", type=int, metavar="QUALITY", help="0 to 100; pictures are not compressed otherwise")
    parser.add_argument("--detector", help="as the mission's option `detector` has it")
    parser.add_argument("--report-score", type=float, help="instead of the mission's")
    parser.add_argument("--confirm-score", type=float, help="instead of the mission's")
    parser.add_argument("--verbose", action="store_true")
    args = parser.parse_args()
    first, last = (int(v) for v in args.seeds.split(":"))
    red, blue = args.white_balance
    change = Change(red, blue, args.jpeg)
    chosen = {"detector": args.detector, "report_score": args.report_score, "confirm_score": args.confirm_score}
    options = Options({name: value for name, value in chosen.items() if value is not None})
    seeing = perception_of(options, FROM_THE_MAST if args.mast else FROM_THE_AIR)
    if args.mast:
        return score_mast(first, last, seeing, change, args.verbose)
    scores = []
    for seed in range(first, last):
        s = score(seed, seeing, args.height, args.spacing, args.every, tuple(args.size), change, args.verbose)
        scores.append(s)
        rmse = math.sqrt(sum(e * e for e in s.errors_m) / max(len(s.errors_m), 1))
        print(
            f"seed {seed:3d}: {s.found}/{s.targets} found, {len(s.wrong)} wrong labels, {len(s.false)} false, "
            f"{s.twice} twice, rmse {rmse:.2f} m, render {s.render_ms:.1f} ms, detect {s.detect_ms:.1f} ms"
            + "".join(f"; missed {m}" for m in s.missed)
            + "".join(f"; WRONG {w}" for w in s.wrong)
            + "".join(f"; FALSE {f}" for f in s.false),
            flush=True,
        )
    targets, found = sum(s.targets for s in scores), sum(s.found for s in scores)
    wrong, false = sum(len(s.wrong) for s in scores), sum(len(s.false) for s in scores)
    errors = [e for s in scores for e in s.errors_m]
    rmse = math.sqrt(sum(e * e for e in errors) / max(len(errors), 1))
    print(
        f"all: {found}/{targets} found ({100.0 * found / targets:.1f} %), {wrong} wrong labels, {false} false, "
        f"{sum(s.twice for s in scores)} twice in {len(scores)} fields, rmse {rmse:.2f} m"
    )
    return 0 if found >= 0.9 * targets and wrong + false <= 0.1 * len(scores) and rmse <= 1.5 else 1


if __name__ == "__main__":
    sys.exit(main())
