"""What cameras see of a world that has no painter of its own: ground, solids and standing things in plain colours.

Rays are cast through a quarter of the pixels (every second of every second row) and shaded by the sun on each surface's
normal; things that lie flat are drawn as their outline on the ground, an orthophoto where there is one. Land use, water
and foliage have one colour each, flames are a glow on the ground. Shadows, smoke, grass and textures are not drawn.
"""

import math
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world import fires, polygons
from sitl_emu.world.description import LAND_USES, Cover, Thing, Water, WorldDescription, WorldError
from sitl_emu.world.moving import place_at
from sitl_emu.world.rays import GROUND, Hits
from sitl_emu.world.solids import Solids

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
Image = npt.NDArray[np.uint8]

REACH_M = 400.0
SKY_BGR = (235.0, 206.0, 170.0)
AMBIENT = 0.45
"""Share of the light that comes from the whole sky."""
PHOTO_GSD_M = 0.2
ABOVE_M = 1000.0
"""From how high a photo is taken: above all that stands."""
COARSE = 2
"""Pixels a ray stands for, along each side."""


class Seen(Protocol):
    """What is looked at: a `world.World`."""

    description: WorldDescription
    solids: Solids | None

    def raycast(self, origins: FloatArray, directions: FloatArray, time_s: float, reach_m: float) -> Hits:
        """Follow (n, 3) rays at a time."""
        ...


class PlainScene:
    """A scene for `camera.Camera`."""

    def __init__(self, world: Seen, folder: Path) -> None:
        """`folder` holds the files that the description names. Raises WorldError."""
        self.world = world
        self.photo: Image | None = None
        if name := world.description.ground.orthophoto:
            photo = cv2.imread(str(folder / name), cv2.IMREAD_COLOR)
            if photo is None:
                raise WorldError(f"ground.orthophoto: {folder / name}: can't be read as a picture")
            self.photo = np.asarray(photo, np.uint8)

    @property
    def seed(self) -> int:
        """See camera.Scene."""
        return self.world.description.seed

    @property
    def moves(self) -> bool:
        """See camera.Scene."""
        described, solids = self.world.description, self.world.solids
        moving = any(thing.path for thing in described.things) or any(fire.spread_m_s for fire in described.fires)
        return moving or (solids is not None and bool(solids.loose_poses()))

    def renderer(self, width: int, height: int, focal_px: float) -> "PlainRenderer":
        """See camera.Scene."""
        return PlainRenderer(self, width, height, focal_px)

    def photo_from_above(self) -> Image:
        """The area's rectangle, north up, uint8 RGB, a pixel every PHOTO_GSD_M."""
        corners = np.array(self.world.description.area_m)
        (south, west), (north, east) = corners.min(axis=0), corners.max(axis=0)
        rows, columns = (max(round(float(side) / PHOTO_GSD_M), 1) for side in (north - south, east - west))
        n = north - (np.repeat(np.arange(rows), columns) + 0.5) * PHOTO_GSD_M
        e = west + (np.tile(np.arange(columns), rows) + 0.5) * PHOTO_GSD_M
        above = np.full(len(n), -ABOVE_M)
        origins = np.stack((n, e, above), axis=1)
        hits = self.world.raycast(origins, np.tile((0.0, 0.0, 1.0), (len(n), 1)), 0.0, 2.0 * ABOVE_M)
        points = origins + np.stack((0.0 * n, 0.0 * n, np.where(np.isfinite(hits.range_m), hits.range_m, 0.0)), axis=1)
        colours = shaded(self, hits, points, 0.0)
        return np.clip(np.round(colours), 0, 255).astype(np.uint8).reshape(rows, columns, 3)[:, :, ::-1]


class PlainRenderer:
    """Draws one scene with one set of intrinsics."""

    def __init__(self, scene: PlainScene, width: int, height: int, focal_px: float) -> None:
        self._scene, self._size = scene, (width, height)
        columns, rows = -(-width // COARSE), -(-height // COARSE)
        x = ((np.arange(columns) + 0.5) * COARSE - width / 2) / focal_px
        y = ((np.arange(rows) + 0.5) * COARSE - height / 2) / focal_px
        self._shape = (rows, columns)
        self._rays = np.stack((np.tile(x, rows), np.repeat(y, columns), np.ones(rows * columns)))

    def draw(self, position_ned_m: FloatArray, camera_to_ned: FloatArray, time_s: float) -> Image:
        """See camera.Renderer."""
        hits, _ = self._look(position_ned_m, camera_to_ned, time_s)
        points = position_ned_m + np.where(np.isfinite(hits.range_m), hits.range_m, 0.0)[:, None] * self._directions
        colours = shaded(self._scene, hits, points, time_s)
        small = np.clip(np.round(colours), 0, 255).astype(np.uint8).reshape(*self._shape, 3)
        return np.asarray(cv2.resize(small, self._size, interpolation=cv2.INTER_LINEAR), np.uint8)

    def depth(self, position_ned_m: FloatArray, camera_to_ned: FloatArray, time_s: float) -> FloatArray:
        """Depth along the optical axis (m; inf for the sky) of every second pixel of every second row."""
        hits, along = self._look(position_ned_m, camera_to_ned, time_s)
        return (hits.range_m * along).reshape(self._shape)

    def _look(self, position: FloatArray, camera_to_ned: FloatArray, time_s: float) -> tuple[Hits, FloatArray]:
        """What the rays meet, and their directions' shares along the optical axis."""
        lengths = np.linalg.norm(self._rays, axis=0)
        self._directions = np.ascontiguousarray((camera_to_ned @ (self._rays / lengths)).T)
        origins = np.broadcast_to(position, self._directions.shape)
        return self._scene.world.raycast(origins, self._directions, time_s, REACH_M), 1.0 / lengths


def shaded(scene: PlainScene, hits: Hits, points: FloatArray, time_s: float) -> FloatArray:
    """(n, 3) BGR of what rays met at `points` (n, 3) at a time, lit by the sun."""
    world = scene.world
    light = world.description.light
    azimuth, elevation = math.radians(light.azimuth_deg), math.radians(light.elevation_deg)
    sun = np.array(
        (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), -math.sin(elevation))
    )
    lit = AMBIENT + (1.0 - AMBIENT) * np.clip(hits.normal @ sun, 0.0, 1.0)
    names = np.array(hits.name)
    on_ground = names == GROUND
    colours = _ground(scene, points, on_ground)
    flames = _burn(world.description, colours, points, on_ground, time_s)
    for thing in world.description.things:
        if thing.height_m == 0.0:
            inside = _inside(thing, place_at(thing, time_s), points[:, 0], points[:, 1])
            colours[on_ground & inside] = _bgr(thing.colour)
    if world.solids is not None:
        for number, name in world.solids.names.items():
            colours[names == name] = _bgr(world.solids.colours[number])
    areas: list[Water | Cover] = [*world.description.water, *world.description.cover]
    for area in areas:
        colours[names == area.name] = _bgr(area.colour)
    colours[~flames] *= (lit[~flames] * light.gain)[:, None]
    colours[names == ""] = SKY_BGR
    return colours


def _ground(scene: PlainScene, points: FloatArray, on_ground: BoolArray) -> FloatArray:
    """(n, 3) BGR of the bare ground at points; elsewhere any."""
    ground = scene.world.description.ground
    colours = np.tile(_bgr(LAND_USES[ground.use] if ground.use else ground.colour), (len(points), 1))
    if scene.photo is not None:
        _look_up_photo(scene, colours, points, on_ground)
    for land in ground.land:
        there = on_ground & polygons.inside(land.polygon_m, points[:, 0], points[:, 1])
        colours[there] = _bgr(LAND_USES[land.use])
    return colours


def _burn(
    described: WorldDescription, colours: FloatArray, points: FloatArray, on_ground: BoolArray, time_s: float
) -> BoolArray:
    """Char what has burnt out, and colour what burns; which points (n,) do."""
    flames = np.zeros(len(points), bool)
    north, east = points[:, 0], points[:, 1]
    for fire in described.fires:
        out = polygons.inside(fires.burnt(fire, described.wind, time_s), north, east)
        colours[on_ground & out] = _bgr(LAND_USES["charred"])
    for fire in described.fires:
        burns = on_ground & fires.burns(fire, described.wind, time_s, north, east)
        colours[burns] = _bgr(fire.colour)
        flames |= burns
    return flames


def _look_up_photo(scene: PlainScene, colours: FloatArray, points: FloatArray, where: BoolArray) -> None:
    photo, ground = scene.photo, scene.world.description.ground
    assert photo is not None
    column = np.floor((points[:, 1] - ground.east0_m) / ground.gsd_m)
    row = photo.shape[0] - 1 - np.floor((points[:, 0] - ground.north0_m) / ground.gsd_m)
    where = where & (column >= 0) & (column < photo.shape[1]) & (row >= 0) & (row < photo.shape[0])
    colours[where] = photo[row[where].astype(int), column[where].astype(int)]


def _bgr(colour: tuple[float, float, float]) -> tuple[float, float, float]:
    red, green, blue = colour
    return 255.0 * blue, 255.0 * green, 255.0 * red


def _inside(thing: Thing, place: tuple[float, float], north: FloatArray, east: FloatArray) -> BoolArray:
    n, e = north - place[0], east - place[1]
    angle, factor = np.arctan2(e, n), np.ones(len(north))
    for k, (amplitude, phase) in enumerate(thing.harmonics, start=2):
        factor += amplitude * np.cos(k * angle + phase)
    limit = thing.radius_m * factor
    return np.asarray(n * n + e * e <= limit * limit)
