"""What is around an SDF world's models: where it lies, which way it is turned, its ground, sun and wind."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import cv2
import numpy as np

from sitl_emu.world.sdf import files
from sitl_emu.world.sdf.poses import F64, HERE, NotRead, Pose, numbers
from sitl_emu.world.terrain import HeightMap

Height = Callable[[float, float], float]
LEVEL = 0.9999
"""Cosine of how far a ground plane may lean."""
SQUARE = 0.01
"""How far the two spacings of a heightmap may differ."""


class Around(NamedTuple):
    """Fields of a world file, and the rotation of SDF's world axes to north, east, down."""

    fields: dict[str, Any]
    turn: F64


def of(world: Element, where: str, not_read: "Counter[str]") -> Around:
    """Origin, sun and wind. Raises WorldError."""
    fields: dict[str, Any] = {}
    place = world.find("spherical_coordinates")
    heading = 0.0
    if place is not None:
        names = (("latitude_deg", "lat_deg"), ("longitude_deg", "lon_deg"), ("elevation", "alt_amsl_m"))
        fields["origin"] = {ours: _number(place, tag, f"{where}: spherical_coordinates") for tag, ours in names}
        heading = _number(place, "heading_deg", f"{where}: spherical_coordinates")
        axes = (place.findtext("world_frame_orientation") or "ENU").strip()
        if axes != "ENU":
            not_read[f"spherical_coordinates: world_frame_orientation {axes}: taken as ENU"] += 1
    # heading_deg turns the world as a heading does, from north over east; without it x is east and y north
    x = math.radians(90.0 + heading)
    turn = np.array(((math.cos(x), math.sin(x), 0.0), (math.sin(x), -math.cos(x), 0.0), (0.0, 0.0, -1.0)))
    turn[abs(turn) < 1e-12] = 0.0
    if (sun := _sun(world, turn, where, not_read)) is not None:
        fields["light"] = sun
    told = world.findtext("wind/linear_velocity")
    if told is not None:
        north, east, _ = turn @ numbers(told, 3, f"{where}: wind: linear_velocity")
        fields["wind"] = {"north_m_s": float(north), "east_m_s": float(east)}
    return Around(fields, turn)


def _number(element: Element, tag: str, where: str) -> float:
    return numbers(element.findtext(tag) or "0", 1, f"{where}: {tag}")[0]


def _sun(world: Element, turn: F64, where: str, not_read: "Counter[str]") -> dict[str, float] | None:
    found = None
    for light in world.findall("light"):
        name = light.get("name", "light")
        if light.get("type") != "directional" or found is not None:
            not_read[f"light {name!r}"] += 1
            continue
        shines = turn @ numbers(light.findtext("direction", "0 0 -1"), 3, f"{where}: light {name!r}: direction")
        if shines[2] <= 0.0:
            not_read[f"light {name!r}: shines from below"] += 1
            continue
        level = math.hypot(shines[0], shines[1])
        azimuth = math.degrees(math.atan2(-shines[1], -shines[0])) if level > 1e-9 else 180.0
        found = {
            "azimuth_deg": round(azimuth, 4),
            "elevation_deg": round(math.degrees(math.atan2(shines[2], level)), 4),
        }
    return found


# --- ground -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Ground:
    """A level plane, or a heightmap."""

    height_m: float
    colour: list[float] | None = None
    file: Path | None = None
    pose: Pose = HERE
    size_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def is_like(self, other: "Ground") -> bool:
        """A plane that is seen and one that is collided with are the same ground."""
        return (self.height_m, self.file, self.size_m) == (other.height_m, other.file, other.size_m)

    def laid(self, turn: F64, folder: Path, not_read: "Counter[str]") -> tuple[dict[str, Any], Height]:
        """As a world file has it, and how high it is at (north, east)."""
        if self.file is None:
            fields: dict[str, Any] = {"terrain": {"height_m": self.height_m}} if self.height_m else {}
            if self.colour is not None:
                fields["ground"] = {"colour": self.colour}
            return fields, lambda north, east: self.height_m
        try:
            return self._relief(turn, folder)
        except NotRead as reason:
            not_read[f"heightmap {self.file}: {reason}"] += 1
            return {}, lambda north, east: 0.0

    def _relief(self, turn: F64, folder: Path) -> tuple[dict[str, Any], Height]:
        assert self.file is not None
        picture = cv2.imread(str(self.file), cv2.IMREAD_UNCHANGED) if self.file.suffix.lower() == ".png" else None
        if picture is None or picture.ndim != 2 or picture.dtype not in (np.uint8, np.uint16) or min(picture.shape) < 2:
            raise NotRead("must be a grey picture (.png); a GeoTIFF is `terrain: {file: …}` of a world file")
        if abs(turn[0, 1] - 1.0) > 1e-9 or self.pose.turn[0, 0] < LEVEL:
            raise NotRead("is turned against north")
        (rows, columns), (x, y, z) = picture.shape, self.size_m
        step = x / (columns - 1)
        if abs(y / (rows - 1) / step - 1.0) > SQUARE:
            raise NotRead("its points are not as far apart to the north as to the east")
        east, north, up = (float(each) for each in self.pose.place)
        fields: dict[str, Any] = {
            "file": files.told_from(folder, self.file), "north0_m": north - 0.5 * y, "east0_m": east - 0.5 * x,
            "spacing_m": step, "low_m": up, "high_m": up + z,
        }  # fmt: skip
        share = picture[::-1].astype(np.float64) / np.iinfo(picture.dtype).max
        relief = HeightMap(up + z * share, fields["north0_m"], fields["east0_m"], step)
        return {"terrain": fields}, relief.height_m


NO_GROUND = Ground(0.0)


def is_level(plane: Element, pose: Pose, where: str) -> bool:
    """Whether a plane looks straight up."""
    normal = np.array(numbers(plane.findtext("normal", "0 0 1"), 3, f"{where}: normal"))
    length = float(np.linalg.norm(normal))
    return length > 1e-9 and float((pose.turn @ normal)[2]) / length > LEVEL


def of_heightmap(element: Element, pose: Pose, folder: Path, where: str) -> Ground:
    """Raises NotRead, WorldError."""
    x, y, z = numbers(element.findtext("size", "1 1 1"), 3, f"{where}: size")
    moved = pose.then(Pose(np.eye(3), np.array(numbers(element.findtext("pos", "0 0 0"), 3, f"{where}: pos"))))
    return Ground(float(moved.place[2]), None, files.find(files.uri_of(element), folder), moved, (x, y, z))
