"""Poses of SDF: "x y z roll pitch yaw", nested, and relative to named frames."""

import math
from collections.abc import Mapping
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from sitl_emu.world.description.common import WorldError

F64 = npt.NDArray[np.float64]
DEEPEST = 50
"""Frames that hang on one another."""


class NotRead(Exception):
    """Something that SDF may hold and this reader does not read; the text is for the list of such."""


class Pose(NamedTuple):
    """Of a frame in another: axes as columns (3, 3), origin (3,)."""

    turn: F64
    place: F64

    def then(self, inner: "Pose") -> "Pose":
        """Of what has the pose `inner` in this one's frame."""
        return Pose(self.turn @ inner.turn, self.place + self.turn @ inner.place)


HERE = Pose(np.eye(3), np.zeros(3))


def numbers(text: str | None, count: int, where: str) -> list[float]:
    """So many finite numbers. Raises WorldError."""
    try:
        values = [float(word) for word in (text or "").split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise WorldError(f"{where}: {(text or '').strip()!r} must be {count} number{'s' if count > 1 else ''}")
    return values


def of(element: Element, where: str) -> tuple[Pose, str]:
    """An element's own pose, and the frame that it is told in (empty: the usual one). Raises WorldError."""
    told = element.find("pose")
    if told is None:
        return HERE, ""
    relative_to = told.get("relative_to", "")
    if not (told.text or "").strip():
        return HERE, relative_to
    if told.get("rotation_format") == "quat_xyzw":
        x, y, z, *xyzw = numbers(told.text, 7, f"{where}: pose")
        length = math.sqrt(sum(each * each for each in xyzw))
        if length < 1e-9:
            raise WorldError(f"{where}: pose: its quaternion is zero")
        return Pose(_of_quaternion(*(each / length for each in xyzw)), np.array((x, y, z))), relative_to
    x, y, z, *angles = numbers(told.text, 6, f"{where}: pose")
    roll, pitch, yaw = (math.radians(a) if told.get("degrees") in ("true", "1") else a for a in angles)
    return Pose(_about(2, yaw) @ _about(1, pitch) @ _about(0, roll), np.array((x, y, z))), relative_to


def _about(axis: int, angle: float) -> F64:
    s, c = math.sin(angle), math.cos(angle)
    turn, (i, j) = np.eye(3), ((1, 2), (2, 0), (0, 1))[axis]
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    return turn


def _of_quaternion(x: float, y: float, z: float, w: float) -> F64:
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )


class Frames:
    """The named frames of a world or a model: its models, links and `frame`s."""

    def __init__(self, scope: Element, where: str, links: Mapping[str, Pose] | None = None) -> None:
        self._where, self._elements = where, dict[str, Element]()
        self._known = dict(links or {})
        for tag in ("model", "link", "frame", "include"):
            for element in scope.findall(tag):
                self._elements.setdefault(name_of(element), element)

    def pose(self, element: Element, deep: int = 0) -> Pose:
        """Of a child, in the scope's frame. Raises WorldError, NotRead."""
        if deep > DEEPEST:
            raise WorldError(f"{self._where}: {name_of(element)!r}: its frames hang on one another in a circle")
        own, relative_to = of(element, f"{self._where}: {name_of(element)}")
        parent = relative_to or (element.get("attached_to", "") if element.tag == "frame" else "")
        if parent in ("", "world", "__model__"):
            return own
        if parent in self._known:
            return self._known[parent].then(own)
        if parent not in self._elements:
            raise NotRead(f"{element.tag} {name_of(element)!r}: its pose is relative to {parent!r}, which is not found")
        return self.pose(self._elements[parent], deep + 1).then(own)


def name_of(element: Element) -> str:
    """Its name; of an include, the one that it gives, or that of the model."""
    if element.tag != "include":
        return element.get("name", element.tag)
    return (element.findtext("name") or element.findtext("uri") or "include").strip().rstrip("/").rsplit("/", 1)[-1]
