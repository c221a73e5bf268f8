"""Vehicles and things in a corn field's pictures, with their shadows, by the general rasteriser.

They stand before the painted field, and behind the plants that stand nearer. Things have their textures, vehicles plain
faces; ground that rises between camera and vehicle does not hide it. Things are cars, trucks, persons, trees, signs and
whatever else a world adds to the field's own patches, which are part of the painting.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.camera import OtherVehicle
from sitl_emu.world.description import Thing
from sitl_emu.world.kinds.corn_field import haze
from sitl_emu.world.kinds.corn_field.dress import PLAIN, Cloth, dress
from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.objects import PAINTED
from sitl_emu.world.kinds.corn_field.sprites import Image
from sitl_emu.world.kinds.corn_field.standing import ERROR_PX, SHADE_LIGHT, farthest_m
from sitl_emu.world.render import edges, material, textures, things
from sitl_emu.world.render.guests import Guests
from sitl_emu.world.render.kernel import F32
from sitl_emu.world.render.maps import Textures
from sitl_emu.world.render.pixels import FIGURES, Picture
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


def is_painted(thing: Thing) -> bool:
    """Whether a thing is one of the field's own patches."""
    return thing.label in PAINTED and thing.height_m == 0.0


class Visitors:
    """All things and all vehicles that were ever told of, in one field."""

    def __init__(self, field: CornField, described: Sequence[Thing] = ()) -> None:
        self._field, self._air, self._haze = field, air_of(field.light), haze.of(field)
        self._stage = Stage()
        own = [(number, thing) for number, thing in enumerate(described) if not is_painted(thing)]
        movers = [things.add(self._stage, thing, field.terrain, field.seed + number) for number, thing in own]
        self._movers = [mover for mover in movers if mover is not None]
        self._things = len(own)
        """How many of the instances, the first ones, are things."""
        self._guests = Guests(self._stage)
        self._packed: tuple[Meshes, Instances] | None = None
        self._of_triangle: npt.NDArray[np.int32] = np.zeros(0, np.int32)
        """The instance of each triangle: every vehicle and thing has meshes of its own."""
        self._materials = material.table()
        self._layers: npt.NDArray[np.int32] = np.zeros(0, np.int32)
        """The texture of each."""
        self._textures = Textures(*textures.empty())
        self._are_drawn: set[int] = set()

    @property
    def move(self) -> bool:
        """Whether any is to be seen somewhere that may move."""
        return bool(self._guests.others or self._movers)

    def put(self, others: Sequence[OtherVehicle]) -> None:
        """See camera.ShowsVehicles."""
        self._guests.others = tuple(others)

    def at(self, time_s: float) -> tuple[Meshes, Instances] | None:
        """Where they are at a time; None: there are none."""
        if self._guests.meet() or (self._packed is None and self._things):
            self._packed = self._pack()
        if self._packed is None or not (self._guests.others or self._things):
            return None
        self._guests.put(self._packed[1], time_s)
        for mover in self._movers:
            things.put(mover, *self._packed, self._field.terrain, time_s)
        return self._packed

    def _pack(self) -> tuple[Meshes, Instances]:
        meshes, placed = self._stage.packed()
        self._of_triangle = np.zeros(len(meshes.triangles), np.int32)
        for row, (first, count) in enumerate(zip(placed.first_level, placed.level_count, strict=True)):
            for level in range(first, first + count):
                self._of_triangle[slice(*meshes.levels[level, 2:4])] = row
        is_thing = self._of_triangle < self._things
        self._layers = np.where(is_thing, self._materials.layer[meshes.materials], PLAIN).astype(np.int32)
        for number in sorted(set(np.unique(self._layers).tolist()) - self._are_drawn - {PLAIN}):
            textures.add(self._textures, number, textures.draw(self._field.seed, number))
            self._are_drawn.add(number)
        return meshes, placed

    def shade(self, seen: Image, camera: Pinhole, vehicles: tuple[Meshes, Instances]) -> None:
        """Darken a picture (height, width, 3) where their shadows fall: on level ground below each."""
        meshes, placed = vehicles
        to_sun = self._air.rows[0].astype(np.float64)
        way = to_sun / min(to_sun[2], -LOWEST_SUN)
        flat = np.eye(3)
        flat[:, 2] -= way
        flat[2] = 0.0
        place = placed.place.copy()
        for row in np.flatnonzero(placed.flags & HIDDEN == 0):
            fallen = place[row] - way * (place[row, 2] + self._field.terrain.height_m(*place[row, :2].tolist()))
            ground = self._field.terrain.height_m(*fallen[:2].tolist())
            place[row] = fallen[0], fallen[1], -ground - SHADOW_M
        laid = placed._replace(
            place=place, rotation=np.ascontiguousarray(flat @ placed.rotation), radius=placed.radius / LOWEST_SUN
        )
        visible = _drawn(meshes, laid, camera)
        if visible is not None:
            dark = visible.buffers.triangle.reshape(seen.shape[:2]) >= 0
            left = np.array(SHADE_LIGHT, np.float32)
            if not self._haze.is_seen(farthest_m(laid, camera)):
                seen[dark] = (seen[dark] * left).astype(np.uint8)
                return
            # Haze has been put before the ground: it is not darkened with it
            near = visible.buffers.nearness.reshape(seen.shape[:2])[dark][:, None]
            veil = self._haze.bgr**2 * (1.0 - np.exp(-self._haze.per_m / near))
            light = np.maximum(seen[dark].astype(np.float32) ** 2 - veil, 0.0)
            seen[dark] = np.sqrt(light * left**2 + veil).astype(np.uint8)

    def draw(self, seen: Image, camera: Pinhole, vehicles: tuple[Meshes, Instances], nearer: F32 | None) -> Image:
        """A picture with the vehicles in it; `nearer`: 1 / distance of plants that may hide them, by pixel."""
        meshes, placed = vehicles
        visible = _drawn(meshes, placed, camera)
        if visible is None:
            return seen
        buffers = visible.buffers
        if nearer is not None:
            hidden = nearer > buffers.nearness
            buffers.triangle[hidden] = -1
            buffers.slot[hidden] = -1
        cloth = Cloth(self._layers, self._textures, self._light(meshes, placed))
        air, figures = self._haze.within(farthest_m(placed, camera)), np.empty(FIGURES, np.float32)
        dress(buffers, visible.drawn, meshes, placed, cloth, camera, air, figures, seen)
        nothing, shape = np.full_like(buffers.nearness, np.inf), seen.shape[:2]
        depth = np.divide(1.0, buffers.nearness, where=buffers.triangle >= 0, out=nothing)
        picture = Picture(seen, depth.reshape(shape), buffers.slot.reshape(shape))
        return edges.smoothed(buffers, visible.drawn, meshes, self._materials.kind, picture)

    def _light(self, meshes: Meshes, placed: Instances) -> F32:
        """See Cloth."""
        turns = placed.rotation[self._of_triangle]
        normals = np.einsum("tij,tj->ti", turns, meshes.normals).astype(np.float32)
        _, direct, above, below, *_ = self._air.rows
        lambert = normals @ self._air.rows[0]
        up = 0.5 - 0.5 * normals[:, 2]
        sides = []
        for side in (1.0, -1.0):
            sky = np.outer(up if side > 0.0 else 1.0 - up, above) + np.outer(1.0 - up if side > 0.0 else up, below)
            light = np.outer(np.maximum(side * lambert, 0.0), direct) + sky
            sides.append(np.sqrt(light * self._air.exposure) * 255.0)
        return np.ascontiguousarray(np.stack(sides, axis=1), np.float32)


def _drawn(meshes: Meshes, placed: Instances, camera: Pinhole) -> Visible | None:
    """What a picture shows of instances; None: nothing."""
    most = len(placed.place)
    chosen, level, first = (np.empty(most, np.int32) for _ in range(3))
    count, corners = select(meshes.levels, meshes.level_errors, placed, camera, ERROR_PX, chosen, level, first)
    if count == 0:
        return None
    drawn = Drawn(chosen, level, first, np.empty((corners, 3), np.float32), np.empty((corners, 3)))
    project(meshes, placed, camera, drawn, count)
    pixels = camera.width * camera.height
    buffers = Buffers(np.empty(pixels, np.float32), np.empty(pixels, np.int32), np.empty(pixels, np.int32))
    rasterise(meshes, placed, camera, drawn, count, buffers, np.empty((4, 3)))
    return Visible(buffers, drawn)
