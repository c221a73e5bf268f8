"""From a world's description to a stage: terrain, solids, things and water, each as the meshes that cameras see."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import quaternion
from sitl_emu.world.camera import body_to_ned
from sitl_emu.world.description import GROUND, Loose, Solid, Thing, WorldDescription
from sitl_emu.world.ground import Terrain
from sitl_emu.world.render import furniture, plants, solid_mesh, surface_mesh, terrain_mesh
from sitl_emu.world.render.ground_map import Frame, frame_of
from sitl_emu.world.render.material import NUMBER
from sitl_emu.world.render.model import Model, lathe, turned
from sitl_emu.world.render.raster import CULLED, DECAL, Instances, Meshes
from sitl_emu.world.render.stage import Stage
from sitl_emu.world.terrain import HeightMap

F64 = npt.NDArray[np.float64]
MARGIN_M = 40.0
"""How far the painted ground reaches beyond what stands on level ground."""
CHUNKS_OF_LEVEL_GROUND = 8


class Mover(NamedTuple):
    """A thing that goes its way."""

    instance: int
    thing: Thing
    plan: F64 | None
    """Of one that lies flat: its outline from above, which is laid on the ground anew."""


@dataclass
class Built:
    """A stage, and what is known of it."""

    stage: Stage
    frame: Frame
    """The part of the world that has a ground map."""
    movers: list[Mover]
    loose: dict[str, int]
    """Instances of loose bodies, by name."""
    terrain: Terrain
    folder: Path
    middle: F64
    """Of all but the far land, and its reach."""
    reach_m: float
    first_fire: int
    """The first fire's object."""

    def add_loose(self, body: Loose) -> None:
        """One that has been released since. Raises WorldError."""
        self.loose[body.name] = _add_solid(self.stage, body, self.terrain, self.folder, 0)

    def lay(self, meshes: Meshes, things: Instances, mover: Mover, north_m: float, east_m: float) -> None:
        """Lay a flat thing on the ground at a place."""
        assert mover.plan is not None
        triangles = meshes.triangles[slice(*meshes.levels[things.first_level[mover.instance], 2:4])]
        first, end = meshes.levels[things.first_level[mover.instance], :2]
        points = surface_mesh.draped(mover.plan, self.terrain, north_m, east_m)
        order = _corner_order(mover.thing)
        low = -self.terrain.height_m(north_m, east_m)
        meshes.corners[first:end] = (points - (0.0, 0.0, low))[order]
        assert len(triangles) * 3 == end - first
        things.place[mover.instance] = (north_m, east_m, low)
        things.rotation[mover.instance] = np.eye(3)
        things.radius[mover.instance] = float(np.abs(meshes.corners[first:end]).max()) * 1.8


def build(described: WorldDescription, terrain: Terrain, folder: Path) -> Built:
    """Everything that stands, lies or moves. Raises WorldError."""
    stage = Stage()
    north, east = _lines(described, terrain)
    _add_terrain(stage, terrain, north, east)
    movers: list[Mover] = []
    for number, solid in enumerate(described.solids):
        _add_solid(stage, solid, terrain, folder, described.seed + number)
    loose = {body.name: _add_solid(stage, body, terrain, folder, described.seed) for body in described.loose}
    for number, thing in enumerate(described.things):
        mover = _add_thing(stage, thing, terrain, described.seed + number)
        if mover is not None:
            movers.append(mover)
    for number, cover in enumerate(described.cover):
        plants.add(stage, cover, terrain, described.seed + 7 * number)
    for pool in described.water:
        model = surface_mesh.water(pool.polygon_m, NUMBER["water"], pool.colour, pool.murk_1_m)
        stage.place(stage.add_model(model), stage.add_object(pool.name, pool.label), (0.0, 0.0, -pool.level_m))
    first_fire = len(stage.names)
    for fire in described.fires:
        stage.add_object(fire.name, fire.label)
    frame = frame_of(float(north[0]), float(east[0]), float(north[-1]), float(east[-1]))
    middle = np.array((0.5 * (north[0] + north[-1]), 0.5 * (east[0] + east[-1]), 0.0))
    middle[2] = -terrain.height_m(float(middle[0]), float(middle[1]))
    reach = 0.5 * math.hypot(float(north[-1] - north[0]), float(east[-1] - east[0]))
    return Built(stage, frame, movers, loose, terrain, folder, middle, reach, first_fire)


# --- ground -----------------------------------------------------------------------------------------------------------


def _lines(described: WorldDescription, terrain: Terrain) -> tuple[F64, F64]:
    """Where the ground has its finest lines: those of the height map, or around all that stands on level ground."""
    if isinstance(terrain, HeightMap):
        rows, columns = terrain.grid_m.shape
        step = 1
        while (rows // step) * (columns // step) > terrain_mesh.MOST_POINTS:
            step *= 2
        spacing = step * terrain.spacing_m
        counts = [
            math.ceil((points - 1) / step / terrain_mesh.CHUNK) * terrain_mesh.CHUNK for points in (rows, columns)
        ]
        return (
            terrain.north0_m + spacing * np.arange(counts[0] + 1),
            terrain.east0_m + spacing * np.arange(counts[1] + 1),
        )
    places = [(place.north_m, place.east_m) for place in described.places.values()]
    places += list(described.area_m)
    places += [(solid.north_m, solid.east_m) for solid in described.solids]
    for thing in described.things:
        places += [(thing.north_m, thing.east_m), *((at.north_m, at.east_m) for at in thing.path)]
    for polygon in _polygons(described):
        places += list(polygon)
    low, high = np.min(places, axis=0) - MARGIN_M, np.max(places, axis=0) + MARGIN_M
    middle, half = 0.5 * (low + high), 0.5 * float((high - low).max())
    steps = np.linspace(-half, half, CHUNKS_OF_LEVEL_GROUND * terrain_mesh.CHUNK + 1)
    return middle[0] + steps, middle[1] + steps


def _polygons(described: WorldDescription) -> list[Sequence[tuple[float, float]]]:
    found: list[Sequence[tuple[float, float]]] = [land.polygon_m for land in described.ground.land]
    found += [water.polygon_m for water in described.water]
    found += [fire.polygon_m for fire in described.fires]
    found += [cover.polygon_m for cover in described.cover]
    return found


def _add_terrain(stage: Stage, terrain: Terrain, north: F64, east: F64) -> None:
    number = stage.add_object(GROUND, "terrain")
    shared = [stage.add_triangles(_ground(terrain_mesh.level_triangles(terrain_mesh.CHUNK >> level)))
              for level in range(terrain_mesh.LEVELS)]  # fmt: skip
    for chunk in terrain_mesh.chunks(terrain, north, east):
        levels = [
            stage.add_level(corners, np.zeros((len(corners), 2), np.float32), triangles, error)
            for corners, error, triangles in zip(chunk.corners, chunk.errors, shared, strict=True)
        ]
        stage.place((levels[0], len(levels)), number, chunk.place)
    step = terrain_mesh.CHUNK
    corners, triangles = terrain_mesh.far_land(terrain, north[::step], east[::step])
    middle = corners.mean(axis=0)
    far = _ground(triangles)
    points = (corners - middle).astype(np.float32)
    level = stage.add_level(points, np.zeros((len(points), 2), np.float32), stage.add_triangles(far))
    stage.place((level, 1), number, tuple(middle))


def _ground(triangles: npt.NDArray[np.int32]) -> Model:
    """Triangles of ground, without corners."""
    count = len(triangles)
    return Model(
        np.zeros((0, 3), np.float32), np.zeros((0, 2), np.float32), triangles,
        np.tile(np.array((0.0, 0.0, -1.0), np.float32), (count, 1)), np.full(count, NUMBER["ground"], np.int32),
        np.ones((count, 3), np.float32),
    )  # fmt: skip


# --- what stands and lies ---------------------------------------------------------------------------------------------


def _add_solid(stage: Stage, solid: Solid, terrain: Terrain, folder: Path, seed: int) -> int:
    """Its instance."""
    model = solid_mesh.mesh_of(solid, folder, seed)
    lift = terrain.height_m(solid.north_m, solid.east_m) + solid.above_ground_m
    if solid.box is not None:
        lift += 0.5 * solid.box.size_m[2]
    elif solid.cylinder is not None:
        lift += 0.5 * solid.cylinder.height_m
    q = quaternion(*(math.radians(angle) for angle in (solid.roll_deg, solid.pitch_deg, solid.heading_deg)))
    flags = 0 if solid.mesh is not None else CULLED
    number = stage.add_object(solid.name, solid.label)
    return stage.place(stage.add_model(model), number, (solid.north_m, solid.east_m, -lift), body_to_ned(q), flags)


def _add_thing(stage: Stage, thing: Thing, terrain: Terrain, seed: int) -> Mover | None:
    """Its mover, if it has a path."""
    number = stage.add_object(thing.name or thing.label, thing.label)
    down = -terrain.height_m(thing.north_m, thing.east_m)
    plan = None
    if thing.height_m > 0.0:
        at = (thing.north_m, thing.east_m, down - thing.above_ground_m)
        turn = turned(math.radians(thing.heading_deg))
        row = stage.place(_add_standing(stage, thing, seed), number, at, turn)
    else:
        plan, triangles = surface_mesh.patch_plan(thing)
        corners = surface_mesh.draped(plan, terrain, thing.north_m, thing.east_m) - (0.0, 0.0, down)
        model = _patch(thing, corners, triangles)
        row = stage.place(stage.add_model(model), number, (thing.north_m, thing.east_m, down), flags=DECAL)
    return Mover(row, thing, plan) if thing.path else None


def _patch(thing: Thing, corners: F64, triangles: npt.NDArray[np.int32]) -> Model:
    order = triangles.reshape(-1)
    count = len(triangles)
    material = NUMBER["weeds" if "weed" in thing.label else "cloth"]
    return Model(
        corners[order].astype(np.float32), (corners[order][:, 1::-1] / 0.8).astype(np.float32),
        np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        np.tile(np.array((0.0, 0.0, -1.0), np.float32), (count, 1)),
        np.full(count, material, np.int32), np.tile(np.array(thing.colour, np.float32), (count, 1)),
    )  # fmt: skip


def _corner_order(thing: Thing) -> npt.NDArray[np.int32]:
    return surface_mesh.patch_plan(thing)[1].reshape(-1)


def _add_standing(stage: Stage, thing: Thing, seed: int) -> tuple[int, int]:
    """What a thing with a height looks like, by its label, as a mesh; unknown ones are the cylinder that they are."""
    radius, height = thing.radius_m, thing.height_m
    label = thing.label
    fine, *coarser = furniture.DETAILS
    if "person" in label or label in ("worker", "pedestrian", "survivor", "victim"):
        figures = [furniture.person(height, thing.colour, seed + thing.seed, each) for each in (fine, *coarser)]
        return stage.add_model(figures[0], *zip(figures[1:], furniture.PERSON_ERRORS_M, strict=True))
    draws = None
    if "truck" in label or label in ("lorry", "van"):
        draws = furniture.truck
    elif "car" in label.split("_") or label == "vehicle":
        draws = furniture.car
    if draws is not None:
        vehicles = [draws(2.0 * radius, thing.colour, each) for each in (fine, *coarser)]
        return stage.add_model(vehicles[0], *zip(vehicles[1:], furniture.VEHICLE_ERRORS_M, strict=True))
    if "tree" in label:
        return stage.add_model(furniture.tree(height, radius, seed + thing.seed, is_conifer="conifer" in label))
    if "stop_sign" in label or label == "stop sign":
        return stage.add_model(furniture.stop_sign(height))
    return stage.add_model(
        lathe(((0.0, 0.0), (radius, 0.0), (radius, height), (0.0, height)), 24, NUMBER["cloth"], thing.colour)
    )
