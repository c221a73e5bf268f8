"""The world of a run: found by its kind or its file, changed as a scenario asks, kept in the run's folder."""

import dataclasses
import json
import os.path
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote

from sitl_emu import vehicles
from sitl_emu.run.messages import LooseAt, VehicleAt
from sitl_emu.run.trouble import Trouble
from sitl_emu.world import description, kinds, sdf
from sitl_emu.world.camera import OtherVehicle, Pose
from sitl_emu.world.conditions import Changes
from sitl_emu.world.description import checks
from sitl_emu.world.obstacles import LoosePose
from sitl_emu.world.world import World

KEPT_AS = "world.yaml"
OUTSIDE = "outside"
"""Beside it: the files that a Gazebo world names elsewhere, each where it lies from the root."""
SUFFIXES = (".yaml", ".yml", *sdf.SUFFIXES)
UNCHANGED = Changes()
THINGS = "things"
"""The option that every kind without a painter has: things that stand or lie in it beside its own."""
MOST_LINES = 20
Body = TypeVar("Body", bound=description.Solid)


class WorldError(Trouble):
    """A world that is unknown or can't be built; the text is one line for people."""


def is_file(source: str) -> bool:
    """Whether a world is named by a file, rather than by its kind."""
    return Path(source).suffix in SUFFIXES


def build(
    source: str,
    seed: int,
    options: Mapping[str, Any],
    changes: Changes = UNCHANGED,
    is_met: bool = True,
) -> World:
    """A world by its kind, generated from a seed and options, or by its file, which has none. Raises WorldError.

    The seed is that of its gusts, whichever it is. `is_met`: see World.
    """
    try:
        if is_file(source):
            if options:
                raise WorldError(f"{source}: a world file has no options, not even {next(iter(options))!r}")
            made = kinds.Generated(description.load(Path(source)))
            folder = Path(source).parent
        else:
            own = {name: value for name, value in options.items() if name != THINGS}
            made = kinds.kind(source).generate(seed, own)
            folder = Path()
        described = made.description
        if options.get(THINGS):
            more = description.things_of(options[THINGS], f"world {source}")
            described = dataclasses.replace(described, things=described.things + more)
        if changes.wind is not None:
            described = dataclasses.replace(described, wind=description.Wind(*dataclasses.astuple(changes.wind)))
        if changes.light is not None:
            light = dataclasses.replace(described.light, **changes.light.given)
            described = dataclasses.replace(described, light=light)
        world = World(described, folder, made.terrain, is_met, seed)
        if is_met:
            _check_files(world)
        return world
    except description.WorldError as error:
        text = str(error)
        is_named = not is_file(source) or text.startswith(source)
        raise WorldError(text if is_named else f"{source}: {text}") from None


def not_read(world: World) -> list[str]:
    """What of a Gazebo world is not there, in lines for people."""
    left = world.description.not_read
    if not left:
        return []
    shown = [f"  {text}" for text in left[:MOST_LINES]]
    more = [f"  and {len(left) - MOST_LINES} more: {KEPT_AS} lists all"] if len(left) > MOST_LINES else []
    return [f"{world.description.name}: not read of the Gazebo world:", *shown, *more]


def keep(world: World, folder: Path) -> Path:
    """Write a world file, and what it names, into a folder, in place of what it has of that; the file.

    Raises OSError.
    """
    for name in files(world):
        source, kept = world.folder / name, folder / _kept_name(name)
        kept.parent.mkdir(parents=True, exist_ok=True)
        if world.is_generated and name == world.description.terrain.file:
            world.write_terrain(kept)
        elif not (kept.exists() and kept.samefile(source)):
            shutil.copyfile(source, kept)
    path = folder / KEPT_AS
    description.save(_renamed(world.description), path)
    return path


def _check_files(world: World) -> None:
    """What World does not read, but cameras, the report and `keep`. Raises description.WorldError."""
    files(world)
    if photo := world.description.ground.orthophoto:
        import cv2  # slow, for worlds with a photo alone

        path = world.folder / photo
        if not path.is_file():
            raise description.WorldError(f"ground.orthophoto: {path}: there is no such file")
        if not cv2.haveImageReader(str(path)):
            raise description.WorldError(f"ground.orthophoto: {path}: can't be read as a picture")


def files(world: World) -> list[str]:
    """What a world names, and what that names. Raises description.WorldError."""
    described = world.description
    named = [described.ground.orthophoto, described.terrain.file]
    for mesh in (solid.mesh for solid in (*described.solids, *described.loose) if solid.mesh is not None):
        named += [mesh.file, *_named_by(world.folder, mesh.file)]
    return list(dict.fromkeys(filter(None, named)))


def _named_by(folder: Path, mesh: str) -> list[str]:
    """What else a mesh file reads: the buffers and pictures of a .gltf. Raises description.WorldError."""
    path = folder / mesh
    if path.suffix.lower() != ".gltf" or not path.is_file():
        return []
    described = json.loads(path.read_text("utf-8"))
    parts = [*described.get("buffers", ()), *described.get("images", ())]
    uris = [unquote(part["uri"]) for part in parts if not part.get("uri", "data:").startswith("data:")]
    beside = Path(mesh).parent
    named = [os.path.normpath(beside / uri) for uri in uris if (folder / beside / uri).is_file()]
    for name in named:
        if not beside.is_absolute() and not checks.is_beside(name):
            raise description.WorldError(f"mesh file {path}: uri = {name!r}: {checks.MUST_BE_BESIDE}")
    return named


def _kept_name(name: str) -> str:
    return str(Path(OUTSIDE, *Path(name).parts[1:])) if Path(name).is_absolute() else name


def _renamed(described: description.WorldDescription) -> description.WorldDescription:
    """With the names of files by which `keep` keeps them."""
    terrain = dataclasses.replace(described.terrain, file=_kept_name(described.terrain.file))
    solids, loose = tuple(map(_mesh_renamed, described.solids)), tuple(map(_mesh_renamed, described.loose))
    return dataclasses.replace(described, terrain=terrain, solids=solids, loose=loose)


def _mesh_renamed(solid: Body) -> Body:
    if solid.mesh is None:
        return solid
    return dataclasses.replace(solid, mesh=dataclasses.replace(solid.mesh, file=_kept_name(solid.mesh.file)))


def expect_parcels(world: World) -> None:
    """Make a world ready for parcels that fall in it. Raises WorldError where physics is not installed."""
    try:
        world.expect_releases()
    except description.WorldError as error:
        raise WorldError(str(error)) from None


def put_loose(world: World, loose: Sequence[LooseAt]) -> None:
    """Put a world's loose bodies where those of the world process are."""
    world.put_loose([LoosePose(description.loose_of(each.described), each.place, each.q) for each in loose])


def placed(seen: Iterable[VehicleAt]) -> list[OtherVehicle]:
    """Other vehicles as a process that makes frames was told of them."""
    return [OtherVehicle(each.name, vehicles.load(each.model), Pose(*each.pose), each.turning) for each in seen]


def kept(path: str, seed: int = 0, is_met: bool = True) -> World:
    """The world that `keep` wrote; `seed`: the run's, for whoever asks for gusts; `is_met`: see World.

    Raises WorldError.
    """
    return build(path, seed, {}, is_met=is_met)
