"""The plants near a camera, drawn as what they are, by the general rasteriser (sitl_emu/world/render)."""

import math

import numpy as np
import numpy.typing as npt

from sitl_emu.world.kinds.corn_field import haze, plant_mesh
from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.haze import Haze, slant, veiled
from sitl_emu.world.kinds.corn_field.objects import outline_factor
from sitl_emu.world.kinds.corn_field.painter import BUCKET_M, Planted, tint_of
from sitl_emu.world.kinds.corn_field.sprites import Image
from sitl_emu.world.render.kernel import F32, I32, ONE, U8, ZERO, f4, kernel
from sitl_emu.world.render.raster import Buffers, Drawn, Instances, Pinhole, project, rasterise, select
from sitl_emu.world.render.sky import fading

FloatArray = npt.NDArray[np.float64]

REACH_M = 22.0
"""How far from the camera, over the ground, plants stand; beyond they are painted."""
ERROR_PX = 0.35
TURN_RAD, GROWTH = 0.15, 0.08
"""How far a plant is turned from its sprite, and larger or smaller than it: standard deviations, ours."""
SHADE_LIGHT = (0.58, 0.50, 0.45)
"""Blue, green, red of what shade leaves of the light: `Painter._shade`."""


@kernel
def paint(
    seen: Buffers, drawn: Drawn, normals: F32, lit: F32, things: Instances, camera: Pinhole, haze: Haze, out: U8
) -> None:
    """The colour of every pixel that a triangle was drawn to; the others stay as they are."""
    for row in range(camera.height):
        for column in range(camera.width):
            at = row * camera.width + column
            number = seen.triangle[at]
            if number < 0:
                continue
            i = drawn.instance[seen.slot[at]]
            towards = (
                (camera.position[0] - things.place[i, 0]) * normals[number, 0]
                + (camera.position[1] - things.place[i, 1]) * normals[number, 1]
                + (camera.position[2] - things.place[i, 2]) * normals[number, 2]
            )
            side = 0 if towards > 0.0 else 1
            clear = ONE
            if haze.per_m > ZERO:
                clear = fading(haze.per_m * slant(camera, row, column) / seen.nearness[at])
            for k in range(3):
                colour = min(lit[number, side, k] * things.tint[i, k], f4(255.0))
                out[row, column, k] = np.uint8(veiled(haze, colour, k, clear) if clear < ONE else colour)


@kernel
def soften(slot: I32, colour: U8, out: U8) -> None:
    """Mix pixels at the edge of a plant with their neighbours: a third of what an edge's exact share would change.

    The general renderer works that share out (edges.py), which takes as long again as all of the rest does here.
    """
    rows, columns = colour.shape[0], colour.shape[1]
    for row in range(1, rows - 1):
        for column in range(1, columns - 1):
            at = row * columns + column
            own = slot[at]
            if slot[at - 1] == own and slot[at + 1] == own and slot[at - columns] == own and slot[at + columns] == own:
                continue
            for k in range(3):
                around = (
                    np.int32(colour[row - 1, column, k])
                    + np.int32(colour[row + 1, column, k])
                    + np.int32(colour[row, column - 1, k])
                    + np.int32(colour[row, column + 1, k])
                )
                out[row, column, k] = np.uint8((np.int32(4) * np.int32(colour[row, column, k]) + around + 4) >> 3)


def farthest_m(things: Instances, camera: Pinhole) -> float:
    """From a camera to the middle of what stands farthest from it."""
    return float(np.linalg.norm(things.place - camera.position, axis=1).max())


class Standing:
    """The plants of one field, for pictures of one size."""

    def __init__(self, field: CornField, planted: Planted, width: int, height: int) -> None:
        self._planted = planted
        self._kinds = plant_mesh.build(field.seed, field.plant_height_m, tint_of(field), field.light)
        plants = planted.plants
        self._ground_m = field.terrain.heights_m(plants.north_m, plants.east_m).astype(np.float32)
        rng = np.random.Generator(np.random.PCG64([field.seed, 0x57A7]))
        count = len(plants.north_m)
        self._turn = rng.normal(scale=TURN_RAD, size=count).astype(np.float32)
        self._growth = np.clip(1.0 + rng.normal(scale=GROWTH, size=count), 0.8, 1.2).astype(np.float32)
        self._tint = (1.0 + rng.normal(scale=0.05, size=(count, 1)) + rng.normal(scale=0.02, size=(count, 3))).astype(
            np.float32
        )
        self._shade(field)
        self._haze = haze.of(field)
        pixels = width * height
        self._buffers = Buffers(np.zeros(pixels, np.float32), np.zeros(pixels, np.int32), np.zeros(pixels, np.int32))
        self._room = 0
        self._seen, self._projected = np.empty((0, 3), np.float32), np.empty((0, 3))

    def _shade(self, field: CornField) -> None:
        plants = self._planted.plants
        for thing in field.objects:
            if thing.kind != "shade":
                continue
            d_north, d_east = plants.north_m - thing.north_m, plants.east_m - thing.east_m
            near = np.flatnonzero((abs(d_north) < 3.0) & (abs(d_east) < 3.0))
            edge_m = thing.radius_m * outline_factor(thing, np.arctan2(d_east[near], d_north[near]))
            share = np.clip((edge_m - np.hypot(d_north[near], d_east[near])) / 0.2 + 0.5, 0.0, 1.0)
            self._tint[near] *= 1.0 - (1.0 - np.array(SHADE_LIGHT, np.float32)) * share[:, None].astype(np.float32)

    def draw(self, background: Image, camera: Pinhole) -> U8:
        """The plants before a picture of the ground (height, width, 3)."""
        things = self._near(camera)
        if things is None:
            self._buffers.nearness[:] = 0.0
            return background
        meshes = self._kinds.meshes
        most = len(things.place)
        chosen, level, first = (np.empty(most, np.int32) for _ in range(3))
        count, corners = select(meshes.levels, meshes.level_errors, things, camera, ERROR_PX, chosen, level, first)
        if corners > self._room:
            self._room = corners + corners // 4
            self._seen, self._projected = np.empty((self._room, 3), np.float32), np.empty((self._room, 3))
        drawn = Drawn(chosen, level, first, self._seen, self._projected)
        self.count = count
        project(meshes, things, camera, drawn, count)
        rasterise(meshes, things, camera, drawn, count, self._buffers, np.empty((4, 3)))
        paint(
            self._buffers, drawn, meshes.normals, self._kinds.lit, things, camera,
            self._haze.within(farthest_m(things, camera)), background,
        )  # fmt: skip
        out = background.copy()
        soften(self._buffers.slot, background, out)
        return out

    @property
    def nearness(self) -> F32:
        """Of the picture drawn last: 1 / distance of the plants, 0 where there are none; by pixel."""
        return self._buffers.nearness

    def _near(self, camera: Pinhole) -> Instances | None:
        """All plants within reach and before the camera, square by square."""
        north, east, _ = (float(each) for each in camera.position)
        low = [math.floor((each - REACH_M) / BUCKET_M) for each in (north, east)]
        high = [math.floor((each + REACH_M) / BUCKET_M) for each in (north, east)]
        buckets = self._planted.buckets
        ahead = camera.rotation[:2, 2]
        behind = -BUCKET_M if abs(float(camera.rotation[2, 2])) < 0.5 else -math.inf
        groups = []
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                d_north, d_east = (i + 0.5) * BUCKET_M - north, (j + 0.5) * BUCKET_M - east
                if d_north * ahead[0] + d_east * ahead[1] >= behind and (i, j) in buckets:
                    groups.append(buckets[i, j])
        if not groups:
            return None
        index = np.concatenate(groups)
        plants = self._planted.plants
        index = index[np.hypot(plants.north_m[index] - north, plants.east_m[index] - east) < REACH_M]
        return self._instances(index) if len(index) else None

    def _instances(self, index: npt.NDArray[np.int32]) -> Instances:
        count = len(index)
        turn, size = self._turn[index], self._growth[index]
        rotation = np.zeros((count, 3, 3))
        # The tangent's half-angle form: no sine that a processor might round otherwise.
        t = 0.5 * turn.astype(np.float64)
        cosine, sine = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
        rotation[:, 0, 0] = rotation[:, 1, 1] = cosine * size
        rotation[:, 0, 1], rotation[:, 1, 0] = -sine * size, sine * size
        rotation[:, 2, 2] = size
        plants, sprite = self._planted.plants, self._planted.sprite[index]
        place = np.stack(
            (plants.north_m[index], plants.east_m[index], -self._ground_m[index].astype(np.float64)), axis=1
        )
        nothing = np.zeros(count, np.int32)
        return Instances(
            self._kinds.first_level[sprite],
            np.full(count, plant_mesh.LEVELS, np.int32),
            rotation,
            np.ascontiguousarray(place),
            1.2 * self._kinds.radius_m[sprite],
            nothing,
            nothing,
            self._tint[index],
        )
