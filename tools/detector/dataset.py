"""Draws a data set: frames of many worlds with their boxes, as COCO and YOLO files, split by world.

Worlds are independent of each other and each is a file of its own under `parts/`: what is there is not drawn again, and
any number of processes comes to the same bytes. A world's frames all lie in one split. See `disaster.py`, `field.py`.
`plan.json` says what was asked for: a folder holds worlds of one plan, of which only the number may grow.
"""

import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import cv2

from sitl_emu.world.labels import coco as coco_table
from sitl_emu.world.labels import yolo
from sitl_emu.world.render.truth import Seen
from tools.detector import disaster, field
from tools.detector.plan import SPLITS, Job, Plan

SUBJECTS = {"disaster": disaster.SUBJECT, "field": field.SUBJECT}
JPEG_QUALITY = 95
OF_ONE_FOLDER = ("subject", "seed", "per_world", "width", "height")
"""What all worlds of a folder have alike."""


def draw(plan: Plan, processes: int) -> dict[str, int]:
    """Draw what is missing, and write all tables; how many images each split has.

    Raises ValueError where the folder holds another plan's worlds.
    """
    _begin(plan)
    todo = wanted(plan)
    for split in SPLITS:
        for kind in ("images", "labels", "regions"):
            (plan.folder / kind / split).mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(processes) as pool:
        for done, job in enumerate(pool.map(draw_world, todo), start=1):
            print(f"\r{done} of {len(todo)} worlds ({job})", end="", flush=True)
    print()
    return tables(plan, todo)


def wanted(plan: Plan) -> list[Job]:
    """The worlds that a plan asks for."""
    return [job for job in SUBJECTS[plan.subject].jobs(plan) if job.split in plan.splits]


def _begin(plan: Plan) -> None:
    """Keep what is asked for, unless something else was."""
    (plan.folder / "parts").mkdir(parents=True, exist_ok=True)
    path, wanted = plan.folder / "plan.json", {key: getattr(plan, key) for key in OF_ONE_FOLDER}
    if path.exists():
        kept = json.loads(path.read_text())
        if kept != wanted:
            told = ", ".join(
                f"{key} {kept.get(key)}, not {wanted[key]}" for key in wanted if kept.get(key) != wanted[key]
            )
            raise ValueError(f"{plan.folder} holds other worlds ({told}): name another folder by --out, or remove it")
    elif any((plan.folder / "parts").iterdir()):
        raise ValueError(f"{plan.folder} holds worlds of an unknown plan: name another folder by --out, or remove it")
    path.write_text(json.dumps(wanted))


def draw_world(job: Job) -> str:
    """Draw one world's frames, unless they are there; its name."""
    part = job.plan.folder / "parts" / f"{job.name}.json"
    if part.exists():
        return job.name
    world = SUBJECTS[job.plan.subject].draw(job)
    rows = []
    for k, frame in enumerate(world.frames):
        name = f"{job.name}_{k:02d}.jpg"
        path = job.plan.folder / "images" / job.split / name
        cv2.imwrite(str(path), frame.image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        if frame.regions is not None:
            path = job.plan.folder / "regions" / job.split / name
            cv2.imwrite(str(path.with_suffix(".png")), frame.regions)
        rows.append({"file": name, "seen": [seen._asdict() for seen in frame.seen], "shot": frame.shot})
    part.write_text(json.dumps({**world.about, "frames": rows}))
    return job.name


# --- tables -----------------------------------------------------------------------------------------------------------


def tables(plan: Plan, done: Sequence[Job]) -> dict[str, int]:
    """Write `SPLIT.json` (COCO), `labels/` (YOLO) and `data.yaml`; how many images each split has."""
    classes = SUBJECTS[plan.subject].classes
    coco: dict[str, dict[str, Any]] = {split: coco_table.table(classes) for split in SPLITS}
    for job in done:
        record = json.loads((plan.folder / "parts" / f"{job.name}.json").read_text())
        for frame in record["frames"]:
            seen = [Seen(**{**each, "box": tuple(each["box"])}) for each in frame["seen"]]
            _add(coco[job.split], frame, record, seen, plan)
            text = yolo.text(seen, classes, plan.width, plan.height)
            (plan.folder / "labels" / job.split / frame["file"]).with_suffix(".txt").write_text(text)
    for split, table in coco.items():
        (plan.folder / f"{split}.json").write_text(json.dumps(table))
    splits = {split: f"images/{split}" for split in SPLITS}
    (plan.folder / "data.yaml").write_text(yolo.data(classes, splits))
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
