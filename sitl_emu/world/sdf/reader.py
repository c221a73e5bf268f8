"""Reads one SDF file, and those that it includes: what stands becomes solids, the rest a list of what was not read."""

import math
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from sitl_emu.world.description.common import WorldError
from sitl_emu.world.sdf import files, safe_xml, shapes, surroundings
from sitl_emu.world.sdf.poses import F64, HERE, Frames, NotRead, Pose, name_of

FLIPPED = np.diag((1.0, -1.0, -1.0))
"""From forward, right, down to forward, left, up."""
DEEPEST = 12
"""Includes and models within one another."""
QUIET = {
    "pose", "static", "frame", "self_collide", "allow_auto_disable", "enable_wind", "inertial", "gravity", "kinematic",
    "velocity_decay", "must_be_base_link", "magnetic_field", "atmosphere",
    "spherical_coordinates", "wind", "light", "model", "include", "link", "visual", "collision",
}  # fmt: skip
"""What is read elsewhere, or is of no meaning for what stands still."""


class Placed(NamedTuple):
    """A shape of the SDF world in its frame."""

    name: str
    label: str
    shape: shapes.Shape
    pose: Pose
    colour: list[float] | None


class Reader:
    """One file. `folder`: whence the files that it names are told."""

    def __init__(self, path: Path, folder: Path) -> None:
        self._path, self._folder = path, folder
        self._placed: list[Placed] = []
        self._ground: surroundings.Ground | None = None
        self._not_read: Counter[str] = Counter()

    def world(self) -> dict[str, Any]:
        """As a world file has it. Raises WorldError."""
        root = safe_xml.read(self._path)
        if root.tag != "sdf":
            raise WorldError(f"{self._path}: not SDF: its root is <{root.tag}>, not <sdf>")
        world = root.find("world")
        if world is None and root.find("model") is None:
            raise WorldError(f"{self._path}: there is neither a <world> nor a <model> in it")
        for other in root.findall("world")[1:]:
            self._not_read[f"world {name_of(other)!r}: a second one"] += 1
        scope = root if world is None else world
        self._children(scope, HERE, Frames(scope, str(self._path)), self._path.parent, "", False, 0)
        self._left(scope, "")
        around = surroundings.of(scope, str(self._path), self._not_read)
        made: dict[str, Any] = {"name": name_of(scope) if world is not None else self._path.stem, **around.fields}
        ground = self._ground or surroundings.NO_GROUND
        if self._ground is None:
            self._not_read["(there is no ground plane: the ground is level at height 0)"] += 1
        fields, height = ground.laid(around.turn, self._folder, self._not_read)
        made |= fields
        names: Counter[str] = Counter()
        made["solids"] = [self._solid(each, around.turn, height, names) for each in self._placed]
        made["not_read"] = [text if count == 1 else f"{text} ({count} times)" for text, count in self._not_read.items()]
        return made

    def _solid(self, placed: Placed, to_ned: F64, height: surroundings.Height, names: "Counter[str]") -> dict[str, Any]:
        shape = placed.shape
        turn = to_ned @ placed.pose.turn @ shape.turn @ FLIPPED
        north, east, down = (float(each) for each in to_ned @ placed.pose.place)
        names[placed.name] += 1
        count = names[placed.name]
        made: dict[str, Any] = {
            "name": placed.name if count == 1 else f"{placed.name} {count}",
            "label": placed.label,
            "north_m": round(north, 6),
            "east_m": round(east, 6),
            "above_ground_m": round(-down - shape.below_m - height(north, east), 6),
            **angles(turn),
            **shape.fields,
        }
        if placed.colour is not None:
            made["colour"] = placed.colour
        if "mesh" in made:
            made["mesh"] = {**made["mesh"], "file": files.told_from(self._folder, Path(made["mesh"]["file"]))}
        return made

    # --- models ---------------------------------------------------------------------------------------------------

    def _children(
        self, scope: Element, outer: Pose, frames: Frames, folder: Path, name: str, is_static: bool, deep: int
    ) -> None:
        """The models of a world or model."""
        for element in scope:
            if element.tag not in ("model", "include"):
                continue
            full = f"{name}{'::' if name else ''}{name_of(element)}"
            try:
                pose = outer.then(frames.pose(element))
                if element.tag == "include":
                    self._include(element, pose, folder, full, is_static, deep)
                else:
                    self._model(element, pose, folder, full, is_static or _is_static(element), deep)
            except NotRead as reason:
                self._not_read[str(reason)] += 1

    def _include(self, element: Element, pose: Pose, folder: Path, name: str, is_static: bool, deep: int) -> None:
        if deep > DEEPEST:
            raise NotRead(f"include {name!r}: more than {DEEPEST} within one another")
        path = files.model_file(files.find(files.uri_of(element), folder))
        try:
            model = safe_xml.read(path).find("model")
        except WorldError as error:
            raise NotRead(str(error)) from None
        if model is None:
            raise NotRead(f"include {name!r}: there is no <model> in {path}")
        told = element.find("static")
        static = is_static or (_is_static(model) if told is None else _is_static(element))
        # The include's own pose stands for the model's
        own = pose if element.find("pose") is not None else pose.then(Frames(model, str(path)).pose(model))
        self._model(model, own, path.parent, name, static, deep)

    def _model(self, model: Element, pose: Pose, folder: Path, name: str, is_static: bool, deep: int) -> None:
        if deep > DEEPEST:
            raise NotRead(f"model {name!r}: more than {DEEPEST} within one another")
        if not is_static:
            raise NotRead(f"model {name!r}: moves (it is not static)")
        frames = Frames(model, f"{self._path}: {name}")
        for link in model.findall("link"):
            try:
                self._link(link, pose.then(frames.pose(link)), folder, name)
            except NotRead as reason:
                self._not_read[str(reason)] += 1
        self._left(model, f"model {name!r}: ")
        self._children(model, pose, frames, folder, name, True, deep + 1)

    def _link(self, link: Element, pose: Pose, folder: Path, model: str) -> None:
        """What is seen of a link, if all of that can be read, else what is collided with."""
        self._left(link, f"model {model!r}: ")
        found, missed = self._shapes(link, "visual", pose, folder, model)
        if missed or not found:
            instead, also_missed = self._shapes(link, "collision", pose, folder, model)
            stands = "; its collision shape stands for it" if instead else ""
            for text in missed:
                self._not_read[text + stands] += 1
            for text in also_missed:
                self._not_read[text] += 1
            found = instead or found
        self._placed += found

    def _shapes(self, link: Element, tag: str, outer: Pose, folder: Path, model: str) -> tuple[list[Placed], list[str]]:
        """Those of a link that can be read, and why the others can't."""
        found, missed = list[Placed](), list[str]()
        for element in link.findall(tag):
            where = f"{model}::{link.get('name', 'link')}::{name_of(element)}"
            geometry = element.find("geometry")
            if geometry is None or geometry.find("empty") is not None:
                continue
            try:
                pose = outer.then(Frames(link, where).pose(element))
                colour = self._colour(element if tag == "visual" else link.find("visual"), where)
                if self._is_ground(geometry, pose, folder, colour, where):
                    continue
                shape = shapes.of(geometry, folder, where)
                name = where if tag == "visual" else f"{where} (collision)"
                found.append(Placed(name, label_of(model), shape, pose, colour))
            except NotRead as reason:
                missed.append(f"{tag} {reason}")
            except WorldError as error:
                raise WorldError(f"{self._path}: {error}") from None
        return found, missed

    def _colour(self, visual: Element | None, where: str) -> list[float] | None:
        material = None if visual is None else visual.find("material")
        if material is None:
            return None
        for tag in ("script", "pbr"):
            if material.find(tag) is not None:
                self._not_read[f"materials of {tag}: textures, but not diffuse colours"] += 1
        told = material.findtext("diffuse") or material.findtext("ambient")
        if told is None:
            return None
        try:
            return [min(max(float(word), 0.0), 1.0) for word in told.split()[:3]]
        except ValueError:
            raise WorldError(f"{where}: material: {told!r} must be 3 or 4 numbers") from None

    def _is_ground(self, geometry: Element, pose: Pose, folder: Path, colour: list[float] | None, where: str) -> bool:
        """Take a level plane or a heightmap as the ground, the first that comes."""
        plane, heightmap = geometry.find("plane"), geometry.find("heightmap")
        if heightmap is not None:
            ground = surroundings.of_heightmap(heightmap, pose, folder, where)
        elif plane is not None and surroundings.is_level(plane, pose, where):
            ground = surroundings.Ground(float(pose.place[2]), colour)
        else:
            return False
        if self._ground is None:
            self._ground = ground
        return self._ground.is_like(ground)

    def _left(self, scope: Element, where: str) -> None:
        """List what an element holds that nothing reads."""
        for child in scope:
            if child.tag not in QUIET:
                self._not_read[f"{where}{child.tag} {child.get('name', '')}".rstrip()] += 1


def _is_static(element: Element) -> bool:
    return (element.findtext("static") or "").strip().lower() in ("true", "1")


def label_of(model: str) -> str:
    """What a model is called, without its number: oak_tree_12 is an oak_tree."""
    return model.split("::")[0].lower().rstrip("0123456789_ ") or model


def angles(turn: F64) -> dict[str, float]:
    """Heading, pitch and roll of a rotation, body (forward, right, down) to NED."""
    pitch = -math.asin(max(-1.0, min(1.0, float(turn[2, 0]))))
    made = {
        "heading_deg": math.degrees(math.atan2(turn[1, 0], turn[0, 0])),
        "pitch_deg": math.degrees(pitch),
        "roll_deg": math.degrees(math.atan2(turn[2, 1], turn[2, 2])),
    }
    return {name: round(value, 6) for name, value in made.items() if abs(value) > 1e-6}
