"""`sitl-emu world export`: pictures of a world with their truth, for whoever trains or scores a detector.

Into one folder: `images/` (JPEG), `masks/` (PNG of 16 bits: the number `instance` of the annotation that a pixel
shows; 0: none), `depth/` (PNG of 16 bits: metres along the optical axis times 256; 0: none, or 255.9 m and more),
`annotations.json` (COCO), `labels/` and `data.yaml` (YOLO), `truth.geojson`, `frames.jsonl` (where and when each
picture was taken) and the world file. Solids, things and loose bodies are instances; of water, fire and plants what the
picture shows is split into regions. Lens distortion and the image sensor's effects are left out.
"""

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.run import folders, views, worlds
from sitl_emu.run.loose_in_run import LooseInRun
from sitl_emu.run.picture_files import jpeg, png
from sitl_emu.run.trouble import Trouble
from sitl_emu.world import kinds
from sitl_emu.world.camera import Renderer
from sitl_emu.world.description import WorldDescription, WorldError
from sitl_emu.world.labels import coco, geojson, yolo
from sitl_emu.world.labels.outline import Mask
from sitl_emu.world.lens import Intrinsics
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.render.scene import View as Drawn
from sitl_emu.world.render.truth import Area, Seen, numbered_things, regions_of
from sitl_emu.world.world import World

FORMATS = ("coco", "yolo", "geojson")
JPEG_QUALITY = 95
EVERY_S = 1.0
"""From picture to picture of a run, unless the user says otherwise."""
PER_METRE = 256.0
"""Depth's unit, that of KITTI's depth pictures."""
GAP_M, LEAST_M2 = 1.0, 0.25
"""Parts of an area nearer than this are one region; of a smaller one is not asked (ours)."""
LEAST_PX = 4.0
"""Boxes with a shorter side are ignored (ours)."""


class Plan(NamedTuple):
    """What is to be written."""

    world: World
    views: Sequence[views.View]
    lens: Intrinsics
    labels: tuple[str, ...]
    """The classes, in their order."""
    formats: frozenset[str]
    folder: Path
    time_s: float
    """Of `truth.geojson`."""
    loose: LooseInRun | None = None
    """Of a run: where its loose bodies were."""

    @property
    def has_frames(self) -> bool:
        """Whether pictures are asked for."""
        return bool(self.formats & {"coco", "yolo"})


class Asked(NamedTuple):
    """What a user asks for: see the command's help."""

    source: str
    seed: int
    options: Mapping[str, Any]
    survey_m: float | None
    overlap: float
    views: Path | None
    vehicle: str | None
    every_s: float | None
    formats: tuple[str, ...]
    labels: tuple[str, ...]
    size: tuple[int, int] | None
    hfov_deg: float | None
    time_s: float


def plan(asked: Asked, folder: Path, say: Callable[[str], None]) -> Plan:
    """What that comes to, with the new folder that it is for; `say`: what a user should know of it. Raises Trouble."""
    if wrong := [each for each in asked.formats if each not in FORMATS]:
        raise Trouble(f"--format {wrong[0]}: give one of {', '.join(FORMATS)}")
    if asked.survey_m is not None and asked.views is not None:
        raise Trouble("--survey and --views: give one of them")
    is_run = (Path(asked.source) / worlds.KEPT_AS).is_file()
    if Path(asked.source).is_dir() and not is_run and asked.source not in kinds.names():
        raise Trouble(f"{asked.source}: no folder of a run: there is no {worlds.KEPT_AS} in it")
    for option, value in (("--vehicle", asked.vehicle), ("--every", asked.every_s)):
        if value is not None and (not is_run or asked.survey_m is not None or asked.views is not None):
            raise Trouble(f"{option}: for pictures that a vehicle took: name the folder of a run, without other views")
    source = str(Path(asked.source) / worlds.KEPT_AS) if is_run else asked.source
    world = worlds.build(source, asked.seed, asked.options)
    for line in worlds.not_read(world):
        say(line)
    loose = _loose(Path(asked.source), world, say) if is_run else None
    width, height = asked.size or (640, 480)
    lens = Intrinsics(width, height, asked.hfov_deg or 90.0)
    chosen: Sequence[views.View]
    if asked.survey_m is not None:
        looks = views.survey(world, asked.survey_m, asked.overlap, lens)
        chosen = [views.view_of(world, look, asked.time_s) for look in looks]
    elif asked.views is not None:
        chosen = views.read(asked.views, world, asked.time_s)
    elif is_run:
        every_s = EVERY_S if asked.every_s is None else asked.every_s
        flown = views.of_run(Path(asked.source), asked.vehicle, every_s)
        width, height = asked.size or flown.lens[:2]
        lens, chosen = Intrinsics(width, height, asked.hfov_deg or flown.lens.hfov_deg), flown.views
        hangs = " from a level gimbal, straight down" if flown.on_gimbal else ""
        missing = "other vehicles, and parcels aboard, are not drawn"
        say(f"{flown.vehicle}'s camera{hangs}, without its lens' distortion; {missing}")
    else:
        chosen = [views.view_of(world, look, asked.time_s) for look in views.looks(world)]
    described = world.description
    if loose is not None:
        described = dataclasses.replace(described, loose=(*described.loose, *loose.released.values()))
        chosen = sorted(chosen, key=lambda view: view.time_s)
    labels = labels_of(described, asked.labels)
    folders.make(folder)
    return Plan(world, chosen, lens, labels, frozenset(asked.formats), folder, asked.time_s, loose)


def _loose(folder: Path, world: World, say: Callable[[str], None]) -> LooseInRun:
    """The loose bodies of a run, in a world that is ready for them. Raises Trouble."""
    loose = LooseInRun(folder, world)
    if loose.released:
        worlds.expect_parcels(world)
    if loose.unknown:
        say(f"left out, as neither {worlds.KEPT_AS} nor scenario.yaml says what it is: {', '.join(loose.unknown)}")
    return loose


class Labelled(NamedTuple):
    """One instance or region in a picture."""

    seen: Seen
    mask: Mask


def labels_of(described: WorldDescription, wanted: Sequence[str]) -> tuple[str, ...]:
    """All labels that a world has, or those of them that are wanted, in that order. Raises Trouble."""
    labels = [each.label for each in described.things]
    labels += [each.label for each in (*described.solids, *described.loose)]
    known = list(dict.fromkeys([*labels, *_areas(described)]))
    for label in wanted:
        if label not in known:
            raise Trouble(f"--label {label}: {described.name} has no such label; it has {', '.join(known) or 'none'}")
    return tuple(dict.fromkeys(wanted)) or tuple(known)


def _areas(described: WorldDescription) -> dict[str, list[str]]:
    """Names of water, fires and plants by their label."""
    made: dict[str, list[str]] = {}
    for water in described.water:
        made.setdefault(water.label, []).append(water.name)
    for fire in described.fires:
        made.setdefault(fire.label, []).append(fire.name)
    for cover in described.cover:
        made.setdefault(cover.label or cover.kind, []).append(cover.name)
    return made


def write(plan: Plan) -> Iterator[int]:
    """Write it all, a picture a step; yields how many are done. Raises WorldError, OSError."""
    worlds.keep(plan.world, plan.folder)
    if "geojson" in plan.formats:
        there = None if plan.loose is None else plan.loose.at(plan.time_s)
        told = geojson.collection(plan.world, plan.time_s, there)
        (plan.folder / "truth.geojson").write_text(json.dumps(told) + "\n")
    if not plan.has_frames:
        return
    parts = ["images", "masks", "depth"] + (["labels"] if "yolo" in plan.formats else [])
    for name in parts:
        (plan.folder / name).mkdir(exist_ok=True)
    table = coco.table(plan.labels, f"{plan.world.description.name}, drawn by sitl-emu")
    eyes = Eyes(plan.world, plan.lens, plan.labels)
    with (plan.folder / "frames.jsonl").open("w") as frames:
        for number, view in enumerate(plan.views, start=1):
            if plan.loose is not None:
                plan.world.put_loose(plan.loose.at(view.time_s))
            picture, drawn, found = eyes.look(view)
            _write_frame(plan, view, picture, drawn, found, table)
            frames.write(json.dumps(_told(view, plan.lens)) + "\n")
            yield number
    if "coco" in plan.formats:
        (plan.folder / "annotations.json").write_text(json.dumps(table))
    if "yolo" in plan.formats:
        (plan.folder / "data.yaml").write_text(yolo.data(plan.labels, {"train": "images", "val": "images"}))


class Eyes:
    """Looks at a world with one lens. Raises WorldError."""

    def __init__(self, world: World, lens: Intrinsics, labels: Sequence[str]) -> None:
        try:
            scene = world.scene()
            self._scene = scene if isinstance(scene, MeshScene) else MeshScene(world, world.folder)
        except WorldError as error:
            raise worlds.WorldError(str(error)) from None
        self._lens = lens
        self._truth = self._scene.renderer(lens.width, lens.height, lens.focal_px)
        # A kind with a painter of its own: its picture, and of the same place what the meshes of its truth show
        self._painter: Renderer | None = None
        if scene is not self._scene:
            self._painter = scene.renderer(lens.width, lens.height, lens.focal_px)
        areas = {label: names for label, names in _areas(world.description).items() if label in labels}
        self._things = {label: label for label in labels if label not in areas}
        objects = list(zip(self._scene.names, self._scene.labels, strict=True))
        self._areas = {
            label: [number for number, (name, of) in enumerate(objects) if of == label and name in names]
            for label, names in areas.items()
        }

    def look(self, view: views.View) -> tuple[npt.NDArray[np.uint8], Drawn, list[Labelled]]:
        """The picture, what it was drawn from, and all that is labelled in it."""
        drawn = self._truth.look(view.place_ned_m, view.camera_to_ned, view.time_s)
        picture = drawn.picture
        if self._painter is not None:
            picture = self._painter.draw(view.place_ned_m, view.camera_to_ned, view.time_s)
        lens = self._lens
        camera = Pinhole(view.place_ned_m, view.camera_to_ned, lens.focal_px, lens.width, lens.height)
        things = numbered_things(self._scene, drawn, camera, self._things, LEAST_PX)
        found = [Labelled(seen, drawn.objects == number) for number, seen in things]
        for label, numbers in self._areas.items():
            mask = np.isin(drawn.objects, numbers)
            regions = regions_of(Area(label, (label,), GAP_M, LEAST_M2), mask, drawn, camera, LEAST_PX)
            found += [Labelled(seen, own) for seen, own in regions]
        return picture, drawn, found


def _write_frame(
    plan: Plan, view: views.View, picture: npt.NDArray[np.uint8], drawn: Drawn, found: Sequence[Labelled],
    table: dict[str, Any],
) -> None:  # fmt: skip
    lens, name = plan.lens, view.name
    image = coco.add_image(table, f"{name}.jpg", lens.width, lens.height, time_s=view.time_s)
    instances = np.zeros((lens.height, lens.width), np.uint16)
    for number, (seen, mask) in enumerate(found, start=1):
        instances[mask] = number
        coco.add(table, image, seen, mask, name=seen.name, whole_bbox=_whole(seen), instance=number)
    near = np.where(drawn.depth_m < 65535.0 / PER_METRE, drawn.depth_m * PER_METRE, 0.0)
    (plan.folder / "images" / f"{name}.jpg").write_bytes(jpeg(picture, JPEG_QUALITY))
    (plan.folder / "masks" / f"{name}.png").write_bytes(png(instances))
    (plan.folder / "depth" / f"{name}.png").write_bytes(png(np.round(near).astype(np.uint16)))
    if "yolo" in plan.formats:
        text = yolo.text([each.seen for each in found], plan.labels, lens.width, lens.height)
        (plan.folder / "labels" / f"{name}.txt").write_text(text)


def _whole(seen: Seen) -> list[float] | None:
    if seen.whole_box is None:
        return None
    left, top, right, bottom = seen.whole_box
    return [left, top, right - left, bottom - top]


def _told(view: views.View, lens: Intrinsics) -> dict[str, Any]:
    return {
        "file": f"{view.name}.jpg",
        "time_s": view.time_s,
        "place_ned_m": view.place_ned_m.tolist(),
        "camera_to_ned": view.camera_to_ned.tolist(),
        "focal_px": lens.focal_px,
    }
