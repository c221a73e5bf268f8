"""From a world's description to a stage: terrain, solids, things and water, each as the meshes that cameras see."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import quaternion
from sitl_emu.world.camera import body_to_ned
from sitl_emu.world.description import GROUND, Loose, Solid, WorldDescription
from sitl_emu.world.ground import Terrain
from sitl_emu.world.render import plants, solid_mesh, surface_mesh, terrain_mesh, things
from sitl_emu.world.render.ground_map import Frame, frame_of
from sitl_emu.world.render.material import NUMBER
from sitl_emu.world.render.model import Model
from sitl_emu.world.render.raster import CULLED
from sitl_emu.world.render.stage import Stage
from sitl_emu.world.terrain import HeightMap

F64 = npt.NDArray[np.float64]
MARGIN_M = 40.0
"""How far the painted ground reaches beyond what stands on level ground."""
CHUNKS_OF_LEVEL_GROUND = 8


@dataclass
class Built:
    """A stage, and what is known of it."""

    stage: Stage
    movers: list[things.Mover]
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


def build(described: WorldDescription, terrain: Terrain, folder: Path) -> Built:
    """Everything that stands, lies or moves. Raises WorldError."""
    stage = Stage()
    north, east = _lines(described, terrain)
    _add_terrain(stage, terrain, north, east)
    movers: list[things.Mover] = []
    for number, solid in enumerate(described.solids):
        _add_solid(stage, solid, terrain, folder, described.seed + number)
    loose = {body.name: _add_solid(stage, body, terrain, folder, described.seed) for body in described.loose}
    for number, thing in enumerate(described.things):
        mover = things.add(stage, thing, terrain, described.seed + number)
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
    middle = np.array((0.5 * (north[0] + north[-1]), 0.5 * (east[0] + east[-1]), 0.0))
    middle[2] = -terrain.height_m(float(middle[0]), float(middle[1]))
    reach = 0.5 * math.hypot(float(north[-1] - north[0]), float(east[-1] - east[0]))
    return Built(stage, movers, loose, terrain, folder, middle, reach, first_fire)


def frame(described: WorldDescription, terrain: Terrain) -> Frame:
    """The part of the world that has a ground map."""
    north, east = _lines(described, terrain)
    return frame_of(float(north[0]), float(east[0]), float(north[-1]), float(east[-1]))


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
