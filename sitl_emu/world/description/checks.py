"""What a world file may not hold though each of its fields is right by itself; each check raises WorldError."""

import os.path
import typing
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sitl_emu.world import polygons
from sitl_emu.world.description.bodies import Solid
from sitl_emu.world.description.common import GROUND, Polygon, WorldError

if typing.TYPE_CHECKING:
    from sitl_emu.world.description import WorldDescription

FLATTEST = 1e-9
"""Of a hull, across over along; ours, as `render.model` has it."""
MUST_BE_BESIDE = "must lie in the world file's folder, or below it; put it there, and name it from there"


def check(described: "WorldDescription", where: str) -> None:
    """All of them; `where` names the source in errors."""
    for number, solid in enumerate(described.solids):
        check_shape(solid, f"{where}: solids[{number}]")
        _check_hull(solid, f"{where}: solids[{number}]")
    for number, loose in enumerate(described.loose):
        check_shape(loose, f"{where}: loose[{number}]")
        _check_hull(loose, f"{where}: loose[{number}]")
    _names(described, where)
    if polygons.crosses_itself(described.area_m):
        raise WorldError(f"{where}: area_m: its sides cross; give its corners in their order around it")
    if described.area_m and (len(described.area_m) < 3 or polygons.area_m2(described.area_m) == 0.0):
        raise WorldError(f"{where}: area_m: give three corners or more, which are not all in one line, or none")
    for place, polygon in _polygons(described):
        if not polygons.is_simple(polygon):
            raise WorldError(f"{where}: {place}.polygon_m: give three corners or more, whose sides do not cross")
    for number, fire in enumerate(described.fires):
        if fire.spread_m_s > 0.0 and not polygons.is_convex(fire.polygon_m):
            raise WorldError(f"{where}: fires[{number}].polygon_m: must be convex where a fire spreads")
    for number, cover in enumerate(described.cover):
        if cover.base_m >= cover.height_m:
            raise WorldError(f"{where}: cover[{number}]: base_m = {cover.base_m:g} must be below height_m")
    for number, thing in enumerate(described.things):
        times = [waypoint.at_s for waypoint in thing.path]
        if sorted(set(times)) != times:
            raise WorldError(f"{where}: things[{number}].path: at_s must grow from waypoint to waypoint, not {times}")
    if not described.places:
        raise WorldError(f"{where}: places: name at least one, such as home: {{north_m: 0, east_m: 0}}")


def check_files(described: "WorldDescription", where: str) -> None:
    """The files that a world file names lie in its folder: a run keeps them in its own by the same names."""
    named = {"terrain.file": described.terrain.file, "ground.orthophoto": described.ground.orthophoto}
    for field in ("solids", "loose"):
        for number, solid in enumerate(getattr(described, field)):
            if solid.mesh is not None:
                named[f"{field}[{number}].mesh.file"] = solid.mesh.file
    for place, name in named.items():
        if not is_beside(name):
            raise WorldError(f"{where}: {place} = {name!r}: {MUST_BE_BESIDE}")


def is_beside(name: str) -> bool:
    """Whether a file's name, as a world file tells it, leads to a place in that one's folder, or below."""
    return not Path(name).is_absolute() and ".." not in Path(os.path.normpath(name)).parts


def check_shape(solid: Solid, where: str) -> None:
    """A solid has exactly one shape."""
    shapes = [shape for shape in (solid.box, solid.cylinder, solid.hull, solid.mesh) if shape is not None]
    if len(shapes) != 1:
        raise WorldError(f"{where} {solid.name!r}: give one of box, cylinder, hull, mesh")


def _check_hull(solid: Solid, where: str) -> None:
    """Its points span a body, as drawing it demands."""
    if solid.hull is None:
        return
    points = np.array(solid.hull.points_m).reshape(-1, 3)
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) >= 4 else np.zeros(3)
    if sizes[2] <= FLATTEST * sizes[0]:
        raise WorldError(f"{where} {solid.name!r}: hull.points_m: give four points or more, not all in one plane")


def _names(described: "WorldDescription", where: str) -> None:
    """What a ray or a wheel can meet has a name of its own."""
    names = {GROUND}
    for field in ("solids", "loose", "water", "fires", "cover"):
        for number, each in enumerate(getattr(described, field)):
            if each.name in names:
                raise WorldError(f"{where}: {field}[{number}]: name = {each.name!r}: another has this name")
            names.add(each.name)


def _polygons(described: "WorldDescription") -> Iterator[tuple[str, Polygon]]:
    for field in ("water", "fires", "cover"):
        for number, each in enumerate(getattr(described, field)):
            yield f"{field}[{number}]", each.polygon_m
    for number, land in enumerate(described.ground.land):
        yield f"ground.land[{number}]", land.polygon_m
