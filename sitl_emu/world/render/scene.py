"""Any world as something that cameras look at (camera.Scene): its geometry built once, its pictures from any place."""

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world import ground
from sitl_emu.world.camera import OtherVehicle, body_to_ned
from sitl_emu.world.description import WorldDescription, WorldError
from sitl_emu.world.obstacles import LoosePose
from sitl_emu.world.render import (
    build,
    burning,
    edges,
    firelight,
    ground_map,
    light_maps,
    material,
    pixels,
    shared,
    soft,
    sprites,
    textures,
    things,
)
from sitl_emu.world.render.guests import Guests
from sitl_emu.world.render.kernel import F32, I32, U8
from sitl_emu.world.render.land import NOISE
from sitl_emu.world.render.maps import FireMap, GroundMap, Relief, SunMap, Surfaces, Textures
from sitl_emu.world.render.pixels import Picture
from sitl_emu.world.render.raster import HIDDEN, Buffers, Drawn, Pinhole, project, rasterise, select
from sitl_emu.world.render.shade import shade
from sitl_emu.world.render.sky import CLOUDS, air_of
from sitl_emu.world.solids import Solids

F64 = npt.NDArray[np.float64]
ERROR_PX = 0.35
"""How far a coarser level may lie from the finest, in the picture."""
PHOTO_GSD_M = 0.2
MOST_PHOTO_PX = 100_000_000
"""Ours: 4 km²; to draw it takes two gigabytes."""
ABOVE_M = 1000.0
"""From how high a photo is taken: above all that stands."""
SKY = -1
"""The object number of nothing."""


class Seen(Protocol):
    """What is looked at: a `world.World`."""

    description: WorldDescription
    terrain: ground.Terrain
    solids: Solids | None


class View(NamedTuple):
    """What a camera sees, all from one geometry."""

    picture: U8
    """(height, width, 3), BGR."""
    depth_m: F32
    """(height, width) along the optical axis; inf for the sky."""
    objects: I32
    """(height, width): numbers in `MeshScene.names` and `labels`; SKY for the sky."""


class _Begun(NamedTuple):
    """What is looked up, as far as it is made before the scene is built, and after."""

    painted: list[Future[GroundMap]]
    """One, until it is taken: nobody keeps it."""
    room: Textures
    drawn: dict[int, Future[None]]
    """Textures, by number."""


class MeshScene:
    """A scene for `camera.Camera`."""

    def __init__(self, world: Seen, folder: Path, shared_memory: int | None = None) -> None:
        """`folder` holds the files that the description names; `shared_memory`: see shared.py. Raises WorldError."""
        described = world.description
        self.world, self.folder = world, folder
        self.air = air_of(described.light)
        # The ground beside the rest: it is mostly numpy's and OpenCV's, which let others run meanwhile
        with shared.turn(shared_memory) as is_ours, ThreadPoolExecutor(1) as beside:
            begun = self._begin(beside) if is_ours else None
            self.built = build.build(described, world.terrain, folder)
            self.guests = Guests(self.built.stage)
            self.meshes, self.things = self.built.stage.packed()
            self.surfaces = self._surfaces(
                shared.arrays(shared_memory, lambda: self._looked_up(beside, begun or self._begin(beside)))
            )
        self._draw_textures()

        self.fires = None
        if described.fires:
            self.fires = sprites.fires_of(described, world.terrain, self.built.first_fire)
            self.frames = sprites.pictures(described.seed)
            self.smoke = sprites.smoke_light(described.fires[0], self.air.rows, self.air.exposure)

    def _photo(self) -> U8 | None:
        name = self.world.description.ground.orthophoto
        if not name:
            return None
        read = cv2.imread(str(self.folder / name), cv2.IMREAD_COLOR)
        if read is None:
            raise WorldError(f"ground.orthophoto: {self.folder / name}: can't be read as a picture")
        return np.asarray(read, np.uint8)

    def _begin(self, beside: Executor) -> _Begun:
        """Paint what the description alone tells: the ground, and the textures of ground and sky."""
        room = Textures(*textures.empty())
        described = self.world.description
        numbers = {int(NOISE), int(CLOUDS), *ground_map.details(described.ground, described.cover)}
        painted = beside.submit(self._painted)
        drawn = {number: beside.submit(self._draw_texture, room, number) for number in numbers}
        return _Begun([painted], room, drawn)

    def _painted(self) -> GroundMap:
        described = self.world.description
        frame = build.frame(described, self.world.terrain)
        return ground_map.packed(frame, ground_map.paint(described, frame, self._photo()))

    def _looked_up(self, beside: Executor, begun: _Begun) -> Iterator[npt.NDArray[Any]]:
        """The arrays of `_surfaces`, in order."""
        for number in self._used() - set(begun.drawn):
            begun.drawn[number] = beside.submit(self._draw_texture, begun.room, number)
        yield from begun.painted.pop().result()
        yield from self._lit()
        for each in begun.drawn.values():
            each.result()
        yield from begun.room
        is_drawn = np.zeros(len(textures.DRAWN), np.uint8)
        is_drawn[list(begun.drawn)] = 1
        yield is_drawn

    def _lit(self) -> Iterator[npt.NDArray[Any]]:
        """Relief, fire and sun: what sun and sky reach of all that is still."""
        built, described = self.built, self.world.description
        frame = build.frame(described, self.world.terrain)
        moving = {mover.instance for mover in built.movers} | set(built.loose.values())
        still = np.array([k for k in range(len(self.things.place)) if k not in moving], np.int32)
        fine = self.things.first_level
        yield from light_maps.relief(self.world.terrain, frame, self.meshes, self.things, still, fine)
        yield from burning.map_of(described, frame)
        sun = light_maps.sun_map(self.air.rows[0].astype(np.float64), built.middle, built.reach_m, self._sun_side)
        near = still[self.things.radius[still] < 4.0 * built.reach_m]
        light_maps.draw(sun, self.meshes, self.things, near, fine)
        yield sun.nearness
        yield sun.frame

    @property
    def _sun_side(self) -> int:
        return min(light_maps.SUN_SIDE, math.ceil(2.0 * self.built.reach_m / light_maps.SUN_FINEST_M))

    def _surfaces(self, arrays: Sequence[npt.NDArray[Any]]) -> Surfaces:
        ground, relief, fire, (nearness, frame, texels, starts, self._is_drawn) = (
            arrays[:4], arrays[4:8], arrays[8:11], arrays[11:]
        )  # fmt: skip
        nothing = SunMap(np.zeros(1, np.float32), 0, np.zeros(13, np.float32))
        sun = SunMap(nearness, self._sun_side, frame)
        return Surfaces(
            Textures(texels, starts), material.table(), GroundMap(*ground), Relief(*relief), FireMap(*fire),
            sun, nothing, firelight.NONE,
        )  # fmt: skip

    def _used(self) -> set[int]:
        """The textures of all meshes and of the sky."""
        return {NOISE, CLOUDS, *material.table().layer[np.unique(self.meshes.materials)].tolist()}

    def _draw_textures(self) -> None:
        """Draw the textures of meshes that nobody had when the others were drawn.

        Others who share them may do so at the same time: they write the same.
        """
        for number in sorted(self._used()):
            if not self._is_drawn[number]:
                self._draw_texture(self.surfaces.textures, number)
                self._is_drawn[number] = 1

    def _draw_texture(self, room: Textures, number: int) -> None:
        textures.add(room, number, textures.draw(self.seed, number))

    @property
    def seed(self) -> int:
        """See camera.Scene."""
        return self.world.description.seed

    @property
    def moves(self) -> bool:
        """See camera.Scene."""
        described = self.world.description
        return bool(self.built.movers or described.water or described.fires or self._loose() or self.guests.rows)

    def put_vehicles(self, others: Sequence[OtherVehicle]) -> None:
        """See camera.ShowsVehicles."""
        self.guests.others = tuple(others)

    def moving_sun(self, camera: Pinhole) -> SunMap:
        """What moves, as the sun sees it, about the place that a camera looks at; `side` 0: nothing does."""
        rows = [mover.instance for mover in self.built.movers] + [*self.built.loose.values(), *self.guests.rows]
        seen = np.array([row for row in rows if not self.things.flags[row] & HIDDEN], np.int32)
        if len(seen) == 0:
            return self.surfaces.moving_sun
        ahead = camera.rotation[:, 2]
        height = -camera.position[2] - self.world.terrain.height_m(*camera.position[:2])
        away = float(np.clip(height / max(ahead[2], 0.05), 4.0, 60.0))
        middle = camera.position + away * ahead
        reach = min(1.3 * away, 60.0)
        near = np.linalg.norm(self.things.place[seen] - middle, axis=1) < 4.0 * reach + 50.0
        sun = light_maps.sun_map(self.air.rows[0].astype(np.float64), middle, reach, light_maps.MOVING_SIDE)
        light_maps.draw(sun, self.meshes, self.things, seen[near], self.things.first_level)
        return sun

    def lamps(self, camera: Pinhole, time_s: float) -> F32:
        """What burns, as what lights in the dark."""
        if self.fires is None:
            return firelight.NONE
        return firelight.lamps_of(self.fires, camera, time_s, self.world.description.light.elevation_deg)

    @property
    def names(self) -> list[str]:
        """Of objects, by number."""
        return self.built.stage.names

    @property
    def labels(self) -> list[str]:
        """Of objects, by number."""
        return self.built.stage.labels

    def ground_m(self, north_m: float, east_m: float) -> float:
        """See camera.Scene."""
        return self.world.terrain.height_m(north_m, east_m)

    def renderer(self, width: int, height: int, focal_px: float) -> "MeshRenderer":
        """See camera.Scene."""
        return MeshRenderer(self, width, height, focal_px)

    def set_time(self, time_s: float) -> None:
        """Put what moves where it is then, and loose bodies and other vehicles where they are now."""
        if self.guests.meet():
            self._pack()
        self._put_loose()
        self.guests.put(self.things, time_s)
        for mover in self.built.movers:
            things.put(mover, self.meshes, self.things, self.world.terrain, time_s)

    def _pack(self) -> None:
        """Anew, with what has come."""
        self.meshes, self.things = self.built.stage.packed()
        self._draw_textures()

    def _loose(self) -> list[LoosePose]:
        return [] if self.world.solids is None else self.world.solids.loose_poses()

    def _put_loose(self) -> None:
        """Also those that have been released since the scene was built."""
        poses = self._loose()
        if new := [pose.described for pose in poses if pose.described.name not in self.built.loose]:
            for body in new:
                self.built.add_loose(body)
            self._pack()
        for pose in poses:
            row, turn = self.built.loose[pose.described.name], body_to_ned(pose.q)
            self.things.rotation[row], self.things.place[row] = turn, np.array(pose.place) - turn @ pose.centre_m

    def photo_from_above(self) -> U8:
        """The area's rectangle, north up, uint8 RGB, a pixel every PHOTO_GSD_M. Raises WorldError for a large one."""
        corners = np.array(self.world.description.area_m)
        (south, west), (north, east) = corners.min(axis=0), corners.max(axis=0)
        rows, columns = (max(round(float(side) / PHOTO_GSD_M), 1) for side in (north - south, east - west))
        if rows * columns > MOST_PHOTO_PX:
            size = f"{north - south:g} x {east - west:g} m"
            most_km2 = MOST_PHOTO_PX * PHOTO_GSD_M**2 * 1e-6
            raise WorldError(f"area_m: a map of {size} can't be drawn; at most {most_km2:g} km²: make it smaller")
        from_above = self.renderer(columns, rows, ABOVE_M / PHOTO_GSD_M)
        north_up = np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
        middle = np.array((0.5 * (south + north), 0.5 * (west + east), -ABOVE_M))
        return np.ascontiguousarray(from_above.look(middle, north_up, 0.0, haze=0.0).picture[:, :, ::-1])


class MeshRenderer:
    """Draws one scene with one set of intrinsics; several may share a scene, one after another."""

    def __init__(self, scene: MeshScene, width: int, height: int, focal_px: float) -> None:
        self.scene, self._size, self._focal_px = scene, (width, height), focal_px
        all_ = width * height
        self._buffers = Buffers(np.zeros(all_, np.float32), np.zeros(all_, np.int32), np.zeros(all_, np.int32))
        self._pixels, self._row = pixels.room(width), soft.room(width)
        self._room = 0
        self.count = 0
        """Instances in the last picture."""

    def draw(self, position_ned_m: F64, camera_to_ned: F64, time_s: float, zoom: float = 1.0) -> U8:
        """See camera.Renderer."""
        return self.look(position_ned_m, camera_to_ned, time_s, zoom=zoom).picture

    def depth(self, position_ned_m: F64, camera_to_ned: F64, time_s: float) -> F32:
        """(height, width) along the optical axis, m; inf for the sky."""
        return self.look(position_ned_m, camera_to_ned, time_s).depth_m

    def look(
        self, position_ned_m: F64, camera_to_ned: F64, time_s: float, haze: float | None = None, zoom: float = 1.0
    ) -> View:
        """Picture, depth and objects from a place (3,) with an attitude (3, 3), camera axes to NED, at a time."""
        scene, (width, height) = self.scene, self._size
        scene.set_time(time_s)
        at, turn = np.ascontiguousarray(position_ned_m, np.float64), np.ascontiguousarray(camera_to_ned, np.float64)
        camera = Pinhole(at, turn, float(self._focal_px) * zoom, width, height)
        count = self.count = self._select(camera)
        project(scene.meshes, scene.things, camera, self._drawn, count)
        rasterise(scene.meshes, scene.things, camera, self._drawn, count, self._buffers, np.empty((4, 3)))
        air = scene.air._replace(time_s=float(time_s), haze=scene.air.haze if haze is None else haze)
        picture = Picture(
            np.empty((height, width, 3), np.uint8),
            np.empty((height, width), np.float32),
            np.empty((height, width), np.int32),
        )
        surfaces = scene.surfaces._replace(moving_sun=scene.moving_sun(camera), lamps=scene.lamps(camera, time_s))
        shade(
            self._buffers,
            self._drawn,
            scene.meshes,
            scene.things,
            surfaces,
            camera,
            air,
            picture,
            picture.colour.reshape(-1),
            self._pixels,
            pixels.memory(),
        )
        smooth = edges.smoothed(self._buffers, self._drawn, scene.meshes, scene.surfaces.materials.kind, picture)
        if scene.fires is not None:
            some = sprites.at_time(scene.fires, scene.world.terrain, camera, time_s, air.haze)
            flat = picture.depth.reshape(-1), picture.objects.reshape(-1), smooth.reshape(-1)
            soft.draw(soft.lay(some, camera), scene.frames, scene.smoke, camera, self._row, *flat)
        return View(smooth, picture.depth, picture.objects)

    def _select(self, camera: Pinhole) -> int:
        """Choose what is in view, and make room for its corners."""
        scene = self.scene
        most = len(scene.things.place)
        chosen, level, first = (np.empty(most, np.int32) for _ in range(3))
        count, corners = select(
            scene.meshes.levels, scene.meshes.level_errors, scene.things, camera, ERROR_PX, chosen, level, first
        )
        away = np.linalg.norm(scene.things.place[chosen[:count]] - camera.position, axis=1)
        order = np.argsort(away - scene.things.radius[chosen[:count]], kind="stable")
        chosen[:count], level[:count] = chosen[order], level[order]
        ranges = scene.meshes.levels[level[:count]]
        first[1:count] = np.cumsum(ranges[:-1, 1] - ranges[:-1, 0])
        if corners > self._room:
            self._room = corners + corners // 4
            self._seen, self._projected = np.empty((self._room, 3), np.float32), np.empty((self._room, 3))
        self._drawn = (
            Drawn(chosen, level, first, self._seen, self._projected)
            if self._room
            else Drawn(chosen, level, first, np.empty((0, 3), np.float32), np.empty((0, 3)))
        )
        return int(count)
