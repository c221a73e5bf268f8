"""Shapes of SDF as a world file's solids have them: which, how far below its middle its underside is, how it is turned.

A solid's hull and mesh are told in its own axes, x forward, y left and z up being those of SDF's link.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from sitl_emu.world.sdf import files
from sitl_emu.world.sdf.poses import F64, NotRead, numbers

MESHES = (".obj", ".stl", ".ply", ".glb", ".gltf")
RINGS, SIDES = 8, 16
"""Of what is round and no cylinder: its hull."""
SHEET_M = 0.02
"""Thickness of a plane that is no ground."""
AS_IT_IS = np.eye(3)
GLTF = np.array(((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
"""Gazebo's way to stand a glTF mesh (y up) upright keeps its x; a solid of ours has its z forward, as glTF says."""


class Shape(NamedTuple):
    """One shape."""

    fields: dict[str, Any]
    """Of a solid: box, cylinder, hull or mesh."""
    below_m: float = 0.0
    """From the point that the solid is turned about to its underside."""
    turn: F64 = AS_IT_IS
    """Before the pose of what has it."""


def of(geometry: Element, folder: Path, where: str) -> Shape:
    """The shape of a `geometry` in a file of `folder`. Raises NotRead, WorldError."""
    for child in geometry:
        if child.tag in READERS:
            return READERS[child.tag](child, folder, f"{where}: {child.tag}")
    tags = ", ".join(child.tag for child in geometry) or "nothing"
    raise NotRead(f"{where}: a shape of {tags}")


def _box(element: Element, folder: Path, where: str) -> Shape:
    size = numbers(element.findtext("size", "1 1 1"), 3, f"{where}: size")
    return Shape({"box": {"size_m": size}}, 0.5 * size[2])


def _cylinder(element: Element, folder: Path, where: str) -> Shape:
    (radius,), (length,) = _number(element, "radius", where), _number(element, "length", where)
    return Shape({"cylinder": {"radius_m": radius, "height_m": length}}, 0.5 * length)


def _number(element: Element, tag: str, where: str) -> list[float]:
    return numbers(element.findtext(tag, "1"), 1, f"{where}: {tag}")


def _sphere(element: Element, folder: Path, where: str) -> Shape:
    (radius,) = _number(element, "radius", where)
    return _hull(_ball(np.full(3, radius)))


def _ellipsoid(element: Element, folder: Path, where: str) -> Shape:
    return _hull(_ball(np.array(numbers(element.findtext("radii", "1 1 1"), 3, f"{where}: radii"))))


def _capsule(element: Element, folder: Path, where: str) -> Shape:
    (radius,), (length,) = _number(element, "radius", where), _number(element, "length", where)
    ball = _ball(np.full(3, radius))
    return _hull(ball + np.stack((0.0 * ball[:, 0], 0.0 * ball[:, 0], np.sign(ball[:, 2]) * 0.5 * length), axis=1))


def _cone(element: Element, folder: Path, where: str) -> Shape:
    (radius,), (length,) = _number(element, "radius", where), _number(element, "length", where)
    angles = np.arange(SIDES) * math.tau / SIDES
    rim = np.stack((radius * np.cos(angles), radius * np.sin(angles), np.full(SIDES, -0.5 * length)), axis=1)
    return _hull(np.concatenate((rim, [(0.0, 0.0, 0.5 * length)])))


def _ball(radii: F64) -> F64:
    """(n, 3) points of an ellipsoid."""
    around = np.arange(SIDES) * math.tau / SIDES
    points = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    for up in np.linspace(-math.pi / 2, math.pi / 2, RINGS + 1)[1:-1]:
        points += [(math.cos(up) * math.cos(a), math.cos(up) * math.sin(a), math.sin(up)) for a in around]
    return np.asarray(np.array(points) * radii)


def _hull(points: F64) -> Shape:
    # A solid's own axes are forward, right and up
    told = (points * (1.0, -1.0, 1.0)).round(6)
    return Shape({"hull": {"points_m": (told + 0.0).tolist()}})


def _sheet(element: Element, folder: Path, where: str) -> Shape:
    """A plane that is not level, or not the ground: a thin box below it."""
    normal = np.array(numbers(element.findtext("normal", "0 0 1"), 3, f"{where}: normal"))
    if np.linalg.norm(normal) < 1e-9 or abs(normal[2]) < 0.999 * np.linalg.norm(normal):
        raise NotRead(f"{where}: its normal is not its z axis")
    x, y = numbers(element.findtext("size", "1 1"), 2, f"{where}: size")
    return Shape({"box": {"size_m": [x, y, SHEET_M]}}, 0.5 * SHEET_M)


def _mesh(element: Element, folder: Path, where: str) -> Shape:
    uri = files.uri_of(element)
    path = files.find(uri, folder)
    if path.suffix.lower() not in MESHES:
        raise NotRead(f"{where}: {uri}: {path.suffix or 'this'} is not read; make it {', '.join(MESHES[:2])} or .glb")
    if element.find("submesh") is not None:
        raise NotRead(f"{where}: {uri}: a submesh of it")
    scale = numbers(element.findtext("scale", "1 1 1"), 3, f"{where}: scale")
    if max(scale) - min(scale) > 1e-6 * max(map(abs, scale)) or scale[0] <= 0.0:
        raise NotRead(f"{where}: {uri}: its scale is not the same to all sides")
    turn = GLTF if path.suffix.lower() in (".glb", ".gltf") else AS_IT_IS
    return Shape({"mesh": {"file": str(path), "scale": scale[0]}}, turn=turn)


READERS: dict[str, Callable[[Element, Path, str], Shape]] = {
    "box": _box, "cylinder": _cylinder, "sphere": _sphere, "ellipsoid": _ellipsoid, "capsule": _capsule, "cone": _cone,
    "plane": _sheet, "mesh": _mesh,
}  # fmt: skip
