"""Draws the data set: frames of many worlds with their boxes, as COCO and YOLO files, split by world.

Worlds are independent of each other and each is a file of its own under `parts/`: what is there is not drawn again, and
any number of processes comes to the same bytes. A world's frames all lie in one split. See `variation.py`.
"""

import json
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import quaternion
from sitl_emu.world import polygons
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.labels import coco as coco_table
from sitl_emu.world.labels import yolo
from sitl_emu.world.lens import Intrinsics, Mount
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.scene import MeshRenderer, MeshScene, View
from sitl_emu.world.render.truth import Area, Seen, regions_in
from tools.detector import variation

FloatArray = npt.NDArray[np.float64]
AREAS = (
    Area("water_body", ("water",), gap_m=3.0, least_m2=4.0, least_hiding=0.4),
    Area("debris_field", ("debris slab", "debris wall", "debris beam"), 1.0, 3.0, ignored=("debris rubble",)),
    Area("fire_region", ("fire",), gap_m=3.0, least_m2=1.5, burns=True),
)
"""The second paper's classes. What makes a region of them is ours."""
CLASSES = tuple(area.label for area in AREAS)
SPLITS = ("train", "val", "test", "asset", "light")
OF_TWENTY, VAL, TEST = 20, (3, 10, 16), (6, 13, 19)
"""Which of twenty worlds of a kind are for validation and test; the others, 70 per cent, are for training."""
JPEG_QUALITY = 95
NEAREST_M = 1.5
"""Frames with anything nearer to the camera are taken elsewhere."""
TRIES = 20


class Plan(NamedTuple):
    """One data set."""

    folder: Path
    images: int = 4200
    """Of training, validation and test together."""
    held_out: int = 360
    """Of each of the sets `asset` and `light`."""
    per_world: int = 24
    width: int = 640
    height: int = 480
    seed: int = 1


class Job(NamedTuple):
    """One world to draw."""

    plan: Plan
    family: str
    number: int

    @property
    def name(self) -> str:
        """Of its files."""
        return f"{self.family}_{self.number:04d}"

    @property
    def split(self) -> str:
        """The usual family's worlds are dealt kind by kind; the other families are sets of their own."""
        if self.family != "usual":
            return self.family
        place = self.number // len(variation.KINDS) % OF_TWENTY
        return "val" if place in VAL else "test" if place in TEST else "train"


class Recorder:
    """A scene for one camera that keeps what was last looked at, with haze of its own."""

    def __init__(self, scene: MeshScene, haze_1_m: float) -> None:
        self.scene, self.haze_1_m = scene, haze_1_m
        self.seed, self.moves = scene.seed, True

    def ground_m(self, north_m: float, east_m: float) -> float:
        """See camera.Scene."""
        return self.scene.ground_m(north_m, east_m)

    def renderer(self, width: int, height: int, focal_px: float) -> "Recorder":
        """See camera.Scene."""
        self._inner = MeshRenderer(self.scene, width, height, focal_px)
        self._size = (focal_px, width, height)
        return self

    def draw(self, position_ned_m: FloatArray, camera_to_ned: FloatArray, time_s: float) -> npt.NDArray[np.uint8]:
        """See camera.Renderer."""
        self.camera = Pinhole(position_ned_m, camera_to_ned, *self._size)
        self.view: View = self._inner.look(position_ned_m, camera_to_ned, time_s, self.haze_1_m)
        return self.view.picture


def jobs(plan: Plan) -> list[Job]:
    """All worlds of a data set."""
    worlds = math.ceil(plan.images / plan.per_world)
    others = math.ceil(plan.held_out / plan.per_world)
    return [Job(plan, "usual", k) for k in range(worlds)] + [
        Job(plan, family, k) for family in variation.FAMILIES[1:] for k in range(others)
    ]


def draw(plan: Plan, processes: int) -> dict[str, int]:
    """Draw what is missing, and write all tables; how many images each split has."""
    todo = jobs(plan)
    for split in SPLITS:
        for kind in ("images", "labels"):
            (plan.folder / kind / split).mkdir(parents=True, exist_ok=True)
    (plan.folder / "parts").mkdir(exist_ok=True)
    with ProcessPoolExecutor(processes) as pool:
        for done, job in enumerate(pool.map(draw_world, todo), start=1):
            print(f"\r{done} of {len(todo)} worlds ({job})", end="", flush=True)
    print()
    return tables(plan, todo)


def draw_world(job: Job) -> str:
    """Draw one world's frames, unless they are there; its name."""
    part = job.plan.folder / "parts" / f"{job.name}.json"
    if part.exists():
        return job.name
    drawn = variation.world(job.number, job.family, job.plan.seed)
    recorder = Recorder(MeshScene(drawn, Path()), drawn.haze_1_m)
    intrinsics = Intrinsics(job.plan.width, job.plan.height)
    cameras: dict[float, Camera] = {}
    rng = np.random.default_rng((job.plan.seed, job.number, variation.FAMILIES.index(job.family), 13))
    targets = targets_of(drawn, rng)
    rows = []
    for k in range(job.plan.per_world):
        for _ in range(TRIES):
            shot = variation.shot(rng, drawn, targets)
            image, found = _frame(recorder, cameras, intrinsics, shot)
            if recorder.view.depth_m.min() > NEAREST_M:
                break
        name = f"{job.name}_{k:02d}.jpg"
        cv2.imwrite(str(job.plan.folder / "images" / job.split / name), image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        rows.append({"file": name, "seen": [seen._asdict() for seen in found], "shot": shot._asdict()})
    light = drawn.description.light
    record = {"kind": drawn.description.name, "haze_1_m": drawn.haze_1_m,
              "sun_deg": light.elevation_deg, "frames": rows}  # fmt: skip
    part.write_text(json.dumps(record))
    return job.name


def _frame(
    recorder: Recorder, cameras: dict[float, Camera], intrinsics: Intrinsics, shot: variation.Shot
) -> tuple[npt.NDArray[np.uint8], list[Seen]]:
    if not cameras:
        cameras[0.0] = Camera(recorder, Mount(0.0, 0.0, 0.0, 90.0), intrinsics)
    up = recorder.scene.world.terrain.height_m(shot.north_m, shot.east_m) + shot.above_m
    pose = Pose(shot.north_m, shot.east_m, -up, quaternion(shot.roll_rad, shot.tilt_rad, shot.heading_rad))
    image = cameras[0.0].render(pose, round(shot.time_s * 1e6))
    return image, regions_in(recorder.scene, recorder.view, recorder.camera, AREAS, shot.time_s)


def targets_of(drawn: variation.Drawn, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Places (north, east) where something of the classes is, or near."""
    described = drawn.description
    places = [(each.north_m, each.east_m) for each in described.solids if each.label.startswith("debris")]
    for fire in described.fires:
        corners = np.array(fire.polygon_m)
        shares = rng.dirichlet(np.ones(len(corners)), 40)
        places += [(float(n), float(e)) for n, e in shares @ corners]
    for water in described.water:
        area = np.array(described.area_m)
        north, east = rng.uniform(area.min(axis=0), area.max(axis=0), (200, 2)).T
        wet = polygons.inside(water.polygon_m, north, east)
        wet &= np.array([drawn.terrain.height_m(n, e) < water.level_m for n, e in zip(north, east, strict=True)])
        places += [(float(n), float(e)) for n, e in zip(north[wet], east[wet], strict=True)]
    return places


# --- tables -----------------------------------------------------------------------------------------------------------


def tables(plan: Plan, done: Sequence[Job]) -> dict[str, int]:
    """Write `SPLIT.json` (COCO), `labels/` (YOLO) and `data.yaml`; how many images each split has."""
    coco: dict[str, dict[str, Any]] = {split: coco_table.table(CLASSES) for split in SPLITS}
    for job in done:
        record = json.loads((plan.folder / "parts" / f"{job.name}.json").read_text())
        for frame in record["frames"]:
            seen = [Seen(**{**each, "box": tuple(each["box"])}) for each in frame["seen"]]
            _add(coco[job.split], frame, record, seen, plan)
            text = yolo.text(seen, CLASSES, plan.width, plan.height)
            (plan.folder / "labels" / job.split / frame["file"]).with_suffix(".txt").write_text(text)
    for split, table in coco.items():
        (plan.folder / f"{split}.json").write_text(json.dumps(table))
    splits = {split: f"images/{split}" for split in SPLITS}
    (plan.folder / "data.yaml").write_text(yolo.data(CLASSES, splits))
    return {split: len(table["images"]) for split, table in coco.items()}


def _add(
    table: dict[str, Any], frame: dict[str, Any], record: dict[str, Any], seen: Sequence[Seen], plan: Plan
) -> None:
    number = coco_table.add_image(
        table, frame["file"], plan.width, plan.height, world=record["kind"], above_m=frame["shot"]["above_m"],
        sun_deg=record["sun_deg"], haze_1_m=record["haze_1_m"],
    )  # fmt: skip
    for each in seen:
        coco_table.add(table, number, each)
