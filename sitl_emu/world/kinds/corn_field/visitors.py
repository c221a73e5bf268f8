"""Other vehicles in a corn field's pictures, with turning propellers and their shadows, by the general rasteriser.

They stand before the painted field, and behind the plants that stand nearer. Their faces are plain, without textures;
ground that rises between camera and vehicle does not hide it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.camera import OtherVehicle
from sitl_emu.world.description import Light
from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.sprites import Image
from sitl_emu.world.kinds.corn_field.standing import ERROR_PX, SHADE_LIGHT, paint, soften
from sitl_emu.world.render.guests import Guests
from sitl_emu.world.render.kernel import F32
from sitl_emu.world.render.raster import HIDDEN, Buffers, Drawn, Instances, Meshes, Pinhole, project, rasterise, select
from sitl_emu.world.render.sky import air_of
from sitl_emu.world.render.stage import Stage

F64 = npt.NDArray[np.float64]
SHADOW_M = 0.02
"""How far over the ground a shadow is drawn; of no meaning but that it is not below."""
LOWEST_SUN = 0.1
"""Sine of the sun's height below which shadows grow no longer."""


class Visible(NamedTuple):
    """What of some instances a picture shows."""

    buffers: Buffers
    drawn: Drawn


class Visitors:
    """All vehicles that were ever told of, in one field."""

    def __init__(self, field: CornField) -> None:
        self._field, self._air = field, air_of(Light(*field.light))
        self._stage = Stage()
        self._guests = Guests(self._stage)
        self._packed: tuple[Meshes, Instances] | None = None
        self._of_triangle: npt.NDArray[np.int32] = np.zeros(0, np.int32)
        """The instance of each triangle: every vehicle has meshes of its own."""

    @property
    def are_there(self) -> bool:
        """Whether any is to be seen somewhere."""
        return bool(self._guests.others)

    def put(self, others: Sequence[OtherVehicle]) -> None:
        """See camera.ShowsVehicles."""
        self._guests.others = tuple(others)

    def at(self, time_s: float) -> tuple[Meshes, Instances] | None:
        """Where they are at a time; None: there are none."""
        if self._guests.meet():
            meshes, things = self._packed = self._stage.packed()
            self._of_triangle = np.zeros(len(meshes.triangles), np.int32)
            for row, level in enumerate(things.first_level):
                self._of_triangle[slice(*meshes.levels[level, 2:4])] = row
        if self._packed is None or not self._guests.others:
            return None
        self._guests.put(self._packed[1], time_s)
        return self._packed

    def shade(self, seen: Image, camera: Pinhole, vehicles: tuple[Meshes, Instances]) -> None:
        """Darken a picture (height, width, 3) where their shadows fall: on level ground below each."""
        meshes, things = vehicles
        to_sun = self._air.rows[0].astype(np.float64)
        way = to_sun / min(to_sun[2], -LOWEST_SUN)
        flat = np.eye(3)
        flat[:, 2] -= way
        flat[2] = 0.0
        place = things.place.copy()
        for row in np.flatnonzero(things.flags & HIDDEN == 0):
            fallen = place[row] - way * (place[row, 2] + self._field.terrain.height_m(*place[row, :2].tolist()))
            ground = self._field.terrain.height_m(*fallen[:2].tolist())
            place[row] = fallen[0], fallen[1], -ground - SHADOW_M
        laid = things._replace(
            place=place, rotation=np.ascontiguousarray(flat @ things.rotation), radius=things.radius / LOWEST_SUN
        )
        visible = _drawn(meshes, laid, camera)
        if visible is not None:
            dark = visible.buffers.triangle.reshape(seen.shape[:2]) >= 0
            seen[dark] = (seen[dark] * np.array(SHADE_LIGHT, np.float32)).astype(np.uint8)

    def draw(self, seen: Image, camera: Pinhole, vehicles: tuple[Meshes, Instances], nearer: F32 | None) -> Image:
        """A picture with the vehicles in it; `nearer`: 1 / distance of plants that may hide them, by pixel."""
        meshes, things = vehicles
        visible = _drawn(meshes, things, camera)
        if visible is None:
            return seen
        buffers = visible.buffers
        if nearer is not None:
            hidden = nearer > buffers.nearness
            buffers.triangle[hidden] = -1
            buffers.slot[hidden] = -1
        turns = things.rotation[self._of_triangle]
        normals = np.einsum("tij,tj->ti", turns, meshes.normals).astype(np.float32)
        paint(buffers, visible.drawn, normals, self._lit(normals, meshes.tints), things, camera, seen)
        out = seen.copy()
        soften(buffers.slot, seen, out)
        return out

    def _lit(self, normals: F32, tints: F32) -> F32:
        """(t, 2, 3): colour of triangles on the side of their normal and on the other; BGR, 0 to 255."""
        _, direct, above, below, *_ = self._air.rows
        lambert = normals @ self._air.rows[0]
        up = 0.5 - 0.5 * normals[:, 2]
        sides = []
        for side in (1.0, -1.0):
            sky = np.outer(up if side > 0.0 else 1.0 - up, above) + np.outer(1.0 - up if side > 0.0 else up, below)
            light = np.outer(np.maximum(side * lambert, 0.0), direct) + sky
            sides.append(np.sqrt(tints * tints * light * self._air.exposure) * 255.0)
        return np.ascontiguousarray(np.clip(np.stack(sides, axis=1)[:, :, ::-1], 0.0, 255.0), np.float32)


def _drawn(meshes: Meshes, things: Instances, camera: Pinhole) -> Visible | None:
    """What a picture shows of instances; None: nothing."""
    most = len(things.place)
    chosen, level, first = (np.empty(most, np.int32) for _ in range(3))
    count, corners = select(meshes.levels, meshes.level_errors, things, camera, ERROR_PX, chosen, level, first)
    if count == 0:
        return None
    drawn = Drawn(chosen, level, first, np.empty((corners, 3), np.float32), np.empty((corners, 3)))
    project(meshes, things, camera, drawn, count)
    pixels = camera.width * camera.height
    buffers = Buffers(np.empty(pixels, np.float32), np.empty(pixels, np.int32), np.empty(pixels, np.int32))
    rasterise(meshes, things, camera, drawn, count, buffers, np.empty((4, 3)))
    return Visible(buffers, drawn)
