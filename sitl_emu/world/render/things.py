"""Things of a world as meshes on a stage: patches, persons, vehicles, trees, signs; and where those are that move."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.description import Thing
from sitl_emu.world.ground import Terrain
from sitl_emu.world.moving import place_at, velocity_at
from sitl_emu.world.render import furniture, surface_mesh
from sitl_emu.world.render.material import NUMBER
from sitl_emu.world.render.model import Model, lathe, turned
from sitl_emu.world.render.raster import DECAL, Instances, Meshes
from sitl_emu.world.render.stage import Stage

F64 = npt.NDArray[np.float64]


class Mover(NamedTuple):
    """A thing that goes its way."""

    instance: int
    thing: Thing
    plan: F64 | None
    """Of one that lies flat: its outline from above, which is laid on the ground anew."""


def add(stage: Stage, thing: Thing, terrain: Terrain, seed: int) -> Mover | None:
    """Add it to a stage: its mover, if it has a path."""
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


def put(mover: Mover, meshes: Meshes, things: Instances, terrain: Terrain, time_s: float) -> None:
    """Where it is at a time, looking where it goes; a flat one is laid on the ground anew."""
    thing, row = mover.thing, mover.instance
    north, east = place_at(thing, time_s)
    speed = velocity_at(thing, time_s)
    if any(speed):
        things.rotation[row] = turned(math.atan2(speed[1], speed[0]))
    if mover.plan is None:
        things.place[row] = (north, east, -terrain.height_m(north, east) - thing.above_ground_m)
    else:
        _lay(mover, mover.plan, meshes, things, terrain, north, east)


def _lay(
    mover: Mover, plan: F64, meshes: Meshes, things: Instances, terrain: Terrain, north_m: float, east_m: float
) -> None:
    triangles = meshes.triangles[slice(*meshes.levels[things.first_level[mover.instance], 2:4])]
    first, end = meshes.levels[things.first_level[mover.instance], :2]
    points = surface_mesh.draped(plan, terrain, north_m, east_m)
    order = _corner_order(mover.thing)
    low = -terrain.height_m(north_m, east_m)
    meshes.corners[first:end] = (points - (0.0, 0.0, low))[order]
    assert len(triangles) * 3 == end - first
    things.place[mover.instance] = (north_m, east_m, low)
    things.rotation[mover.instance] = np.eye(3)
    things.radius[mover.instance] = float(np.abs(meshes.corners[first:end]).max()) * 1.8


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
