"""The static part of a Gazebo world (SDF, http://sdformat.org) as plain data, such as a world file's YAML holds.

What is read: static models with their links and nested models, `include` of files that lie here, poses with
`relative_to`, boxes, cylinders, spheres, capsules, ellipsoids, cones, planes, meshes (OBJ, STL, PLY, glTF), a grey
heightmap, diffuse colours, the sun (the first directional light), wind, and `spherical_coordinates` as origin. One
shape stands here for what Gazebo sees and what it collides with: the visuals where all of a link's can be read, else
its collisions. All else is named in `not_read`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sitl_emu.world.description.common import WorldError
from sitl_emu.world.sdf.reader import Reader

SUFFIXES = (".sdf", ".world")


def read(path: Path, folder: Path | None = None) -> dict[str, Any]:
    """An SDF file as a world file has it; files that it names are told from `folder`, by default its own.

    Raises WorldError for what is no SDF; what it holds and can't be read is listed instead.
    """
    return Reader(path, path.parent if folder is None else folder).world()


def joined(data: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """A world file's data with those of the SDF file that its `sdf` names; its own come first. Raises WorldError."""
    own = dict(data)
    name = own.pop("sdf")
    if not isinstance(name, str):
        raise WorldError(f"{path}: sdf = {name!r} must be the name of a file ({', '.join(SUFFIXES)})")
    other = read(path.parent / name, path.parent)
    made = other | own
    for field in ("solids", "not_read"):
        made[field] = [*_list(own, field, path), *other.get(field, [])]
    return made


def _list(own: Mapping[str, Any], field: str, path: Path) -> list[Any]:
    given = own.get(field, [])
    if not isinstance(given, list):
        raise WorldError(f"{path}: {field} = {given!r} must be a list")
    return given
