"""Trains the classical detector's small classifier on fields of seeds kept for it, and writes its weights.

    python tools/agriculture/train_detector.py [--seeds 100:160] [--frames 36]
                                               [--out missions/agriculture/detector_weights.json]

One command, the same weights each time on one machine. Frames are taken over each field from 11 to 21 m, at any
heading and a few degrees of tilt, most of them near an object (targets and distractors alike, residue more often than
the rest), and a fifth of them from the rover's mast. A cell whose middle lies within a target's outline is that target;
one near the outline is left out; all others are neither. Softmax regression with one hidden layer, Adam, numpy. A first
classifier, trained on half of the fields, picks what it gets wrong on the other half (hard negatives); the second is
trained on all of it. Judge the result with `tools/agriculture/score_detector.py` on other seeds.
"""

import argparse
import json
import math
import sys
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.agriculture import detector as det
from sitl_emu.missions.companion.camera_model import MAST as MODEL_MAST
from sitl_emu.missions.companion.camera_model import NADIR as MODEL_NADIR
from sitl_emu.missions.companion.camera_model import CameraModel, Mount, camera_pose, project
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.kinds.corn_field import field as corn_field
from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.objects import outline
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.lens import MAST, NADIR

Floats = npt.NDArray[np.float32]
Image = npt.NDArray[np.uint8]

CELLS_PER_FRAME = 300
"""Cells taken of each frame that are nothing in particular."""
STAGES = (8, 5, 7, 8, 6, 7)
"""Growth stages of the fields, in turn: the more the rows close, the harder it is."""
HARD = 0.05
"""Probability from which a cell that is no target is one to learn from."""
TARGET_WEIGHT = 2.0
"""What a target's cell counts: they are few, and the hard cells make them rarer still."""
MODEL = CameraModel()


def tilt(rng: np.random.Generator, sigma_rad: float) -> tuple[float, float]:
    """A roll and a pitch."""
    return float(rng.normal(scale=sigma_rad)), float(rng.normal(scale=sigma_rad))


def label_picture(field: CornField, pose: Pose, mount: Mount) -> Image:
    """(480, 640): 0 neither, 1 weed, 2 disease, 255 near a target's outline; and 254 within a distractor."""
    picture = np.zeros((MODEL.height, MODEL.width), np.uint8)
    camera = camera_pose((pose.north_m, pose.east_m, pose.down_m), pose.q, mount)
    for thing in field.objects:
        value = det.LABELS.index(thing.kind) + 1 if thing.is_target else 254
        rings = ((1.5, 255), (0.85, value)) if thing.is_target else ((1.0, value),)
        for scale, mark in rings:
            shape = outline(thing._replace(radius_m=thing.radius_m * scale + (0.12 if scale > 1 else 0.0)))
            lift = 0.3 * field.plant_height_m
            pixels = []
            for north, east in shape.tolist():
                point = (north, east, -field.terrain.height_m(north, east) - lift)
                pixels.append(project(MODEL, camera, point))
            if all(p is not None and abs(p[0]) < 4000 and abs(p[1]) < 4000 for p in pixels):
                cv2.fillPoly(picture, [np.round(np.array(pixels)).astype(np.int32)], mark)
    return picture


def sample(
    seed: int, frames: int, rng: np.random.Generator, miner: det.Weights | None
) -> tuple[Floats, npt.NDArray[np.uint8]]:
    """(features, labels) of cells of frames over one field."""
    # More of everything on each field than a mission meets: looks at many patches cost no more than looks at few.
    stage = STAGES[seed % len(STAGES)]
    field = corn_field.build(seed, targets=16, distractors=56, growth_stage=stage)
    nadir, mast = Camera(FieldScene(field), NADIR), Camera(FieldScene(field), MAST)
    residue = [thing for thing in field.objects if thing.kind == "residue"]
    xs, ys = [], []
    for i in range(frames):
        from_mast = i % 5 == 4
        thing = field.objects[int(rng.integers(len(field.objects)))]
        if i % 5 in (0, 1):
            thing = field.targets[int(rng.integers(len(field.targets)))]
        if i % 10 == 2:
            thing = residue[int(rng.integers(len(residue)))]
        yaw = rng.uniform(0, math.tau)
        if from_mast:
            ahead = rng.uniform(0.3, 3.5)
            north, east = thing.north_m - ahead * math.cos(yaw), thing.east_m - ahead * math.sin(yaw)
            down = -field.terrain.height_m(north, east) - 0.2
            pose = Pose(north, east, down, quaternion(*tilt(rng, 0.04), yaw + float(rng.normal(scale=0.3))))
            camera, mount = mast, MODEL_MAST
            gsd = 2.0 / math.sin(math.radians(60)) / MODEL.focal_px
        else:
            if i % 5 == 3:
                north, east = rng.uniform(-4, field.size_m[0] + 4), rng.uniform(-4, field.size_m[1] + 4)
            else:
                north, east = thing.north_m + rng.uniform(-11, 11), thing.east_m + rng.uniform(-11, 11)
            down = -rng.uniform(11, 21)
            pose = Pose(north, east, down, quaternion(*tilt(rng, 0.06), yaw))
            camera, mount = nadir, MODEL_NADIR
            gsd = -down / MODEL.focal_px
        image = camera.render(pose, int(rng.integers(1 << 40)))
        work = det.reduce(image, gsd)
        averaged = det.windows(work)
        cells = det.features(averaged)
        marks = label_picture(field, pose, mount)
        rows, columns = cells.shape[:2]
        y = ((np.arange(rows) + 0.5) * det.CELL_PX * 480 / work.shape[0]).astype(int)
        x = ((np.arange(columns) + 0.5) * det.CELL_PX * 640 / work.shape[1]).astype(int)
        at = marks[np.ix_(y, x)].ravel()
        flat = cells.reshape(-1, cells.shape[2])
        chosen = [np.flatnonzero((at == 1) | (at == 2)), np.flatnonzero(at == 254)]
        plain = np.flatnonzero(at == 0)
        chosen.append(rng.choice(plain, size=min(CELLS_PER_FRAME, len(plain)), replace=False))
        if miner is not None:
            likely = 1.0 - det.probabilities(averaged, miner)[0].ravel()
            chosen.append(plain[likely[plain] > HARD])
        index = np.concatenate(chosen)
        xs.append(flat[index])
        ys.append(np.where(at[index] == 254, 0, at[index]))
    return np.concatenate(xs), np.concatenate(ys)


def train(x: Floats, y: npt.NDArray[np.int64], rng: np.random.Generator, hidden: int, epochs: int) -> det.Weights:
    """Weights by Adam on softmax cross-entropy, for features as they come."""
    mean, scale = x.mean(axis=0), x.std(axis=0) + 1e-4
    x = (x - mean) / scale
    sizes = (x.shape[1], hidden, 3)
    p = [
        rng.normal(scale=math.sqrt(2 / sizes[0]), size=(sizes[0], hidden)).astype(np.float32),
        np.zeros(hidden, np.float32),
        rng.normal(scale=math.sqrt(1 / hidden), size=(hidden, 3)).astype(np.float32),
        np.zeros(3, np.float32),
    ]
    m, v = [np.zeros_like(a) for a in p], [np.zeros_like(a) for a in p]
    step, batch = 0, 1024
    for epoch in range(epochs):
        order = rng.permutation(len(x))
        rate = 3e-3 * (0.5 + 0.5 * math.cos(math.pi * epoch / epochs)) + 1e-5
        loss = 0.0
        for k in range(0, len(order), batch):
            index = order[k : k + batch]
            a, t = x[index], y[index]
            h = np.maximum(a @ p[0] + p[1], 0.0)
            z = h @ p[2] + p[3]
            z -= z.max(axis=1, keepdims=True)
            e = np.exp(z)
            e /= e.sum(axis=1, keepdims=True)
            loss -= float(np.log(e[np.arange(len(t)), t] + 1e-9).sum())
            e[np.arange(len(t)), t] -= 1.0
            e *= np.where(t > 0, np.float32(TARGET_WEIGHT), np.float32(1.0))[:, None] / np.float32(len(t))
            dh = (e @ p[2].T) * (h > 0)
            g = [a.T @ dh + 2e-5 * p[0], dh.sum(axis=0), h.T @ e + 2e-5 * p[2], e.sum(axis=0)]
            step += 1
            for j in range(4):
                m[j] = 0.9 * m[j] + 0.1 * g[j]
                v[j] = 0.999 * v[j] + 0.001 * g[j] ** 2
                p[j] -= rate * (m[j] / (1 - 0.9**step)) / (np.sqrt(v[j] / (1 - 0.999**step)) + 1e-8)
        if epoch % 5 == 4:
            print(f"epoch {epoch + 1}: loss {loss / len(x):.4f}", flush=True)
    # Trained on features of mean 0 and deviation 1; the first layer takes that step upon itself.
    return det.Weights(p[0] / scale[:, None], p[1] - (mean / scale) @ p[0], p[2], p[3])


def gather(seeds: range, frames: int, miner: det.Weights | None) -> tuple[Floats, npt.NDArray[np.int64]]:
    """(features, labels) of cells of many fields."""
    parts = [sample(seed, frames, np.random.Generator(np.random.PCG64([seed, 5])), miner) for seed in seeds]
    x, y = np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts]).astype(np.int64)
    print(f"{len(x)} cells, weed {int((y == 1).sum())}, disease {int((y == 2).sum())}", flush=True)
    return x, y


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", default="100:160", help="first:end, end left out")
    parser.add_argument("--frames", type=int, default=36, help="frames of each field")
    parser.add_argument("--hidden", type=int, default=48, help="hidden units")
    parser.add_argument("--epochs", type=int, default=16)
    parser.add_argument("--cache", type=Path, help="keep the sampled cells in this .npz, and use it if it is there")
    parser.add_argument("--out", type=Path, default=det.WEIGHTS)
    args = parser.parse_args()
    first, last = (int(v) for v in args.seeds.split(":"))
    if args.cache and args.cache.exists():
        kept = np.load(args.cache)
        x, y = kept["x"], kept["y"]
    else:
        middle = (first + last) // 2
        x, y = gather(range(first, middle), args.frames, None)
        miner = train(x, y, np.random.Generator(np.random.PCG64(1)), args.hidden, 8)
        more_x, more_y = gather(range(middle, last), args.frames, miner)
        x, y = np.concatenate((x, more_x)), np.concatenate((y, more_y))
        if args.cache:
            np.savez(args.cache, x=x, y=y)
    weights = train(x, y, np.random.Generator(np.random.PCG64(2)), args.hidden, args.epochs)
    stored = {name: np.vectorize(lambda v: float(f"{v:.5g}"))(values) for name, values in weights._asdict().items()}
    args.out.write_text(json.dumps({name: values.tolist() for name, values in stored.items()}) + "\n")


if __name__ == "__main__":
    main()
