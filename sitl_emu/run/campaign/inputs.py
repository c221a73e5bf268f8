"""What a campaign's runs read beside their scenarios, by content: so that no result passes for one of edited files.

Files: a world's with all that it names, a vehicle's folder, and what else a scenario names by its whole path, as
options and words of commands are once they are checked. Code: sitl-emu's, as its version does not move from commit to
commit, and that of the packages which bring the scenario's missions.

What is not seen: what a command's program reads or imports, what lies in a folder that an option names, the versions of
other packages (numpy, PyBullet), and, on a Dask cluster, all of this on the workers but sitl-emu's version.
"""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from sitl_emu import vehicles
from sitl_emu.missions import registry
from sitl_emu.run import worlds
from sitl_emu.run.scenario import Scenario
from sitl_emu.world import description
from sitl_emu.world.world import World

OURS = ("sitl_emu", "sitl_emu.vehicles", "sitl_emu.autopilot", "sitl_emu.gcs", "sitl_emu.missions")
"""The package, and its rooms, which lie beside it in a checkout."""
READ = {".py", ".json", ".toml", ".yaml", ".yml", ".onnx", ".plan"}
"""Suffixes of code and of what lies with it; without what is made of it (compiled modules, caches), and texts."""
SKIPPED = {"__pycache__", "runs"}
LENGTH = 16
"""Of a hash as it is kept; ours: nobody forges these."""
HERE = Path(__file__).resolve().parent
"""Makes tables of runs, and changes none of them."""


def files_of(scenario: Scenario, world: World) -> set[Path]:
    """The files that an arm's runs read, in whole."""
    named = {path for path in map(Path, _texts(scenario.model_dump(mode="json"))) if path.is_absolute()}
    folders = {path for path in named if _is(path, "is_dir") and vehicles.is_folder(path)}
    named |= {folder / name for folder in folders for name in (vehicles.TOML, vehicles.AIRFRAME)}
    named |= {Path(world.folder / name).absolute() for name in worlds.files(world)}
    return {path for path in named if _is(path, "is_file")}


def programs_of(scenario: Scenario) -> set[str]:
    """The names of the programs that its companions run."""
    return {one.companion.mission for one in scenario.vehicles if one.companion and one.companion.mission}


def contents(files: set[Path], programs: set[str]) -> dict[str, str]:
    """A short hash of each file and package, by the name that people are told."""
    found = {"sitl-emu's own code": _of_code(OURS)}
    for module in registry.modules_of(programs):
        package = module.partition(".")[0]
        if package != OURS[0]:
            found[f"the code of {package}"] = _of_code([package])
    return found | {str(path): _of_file(path) for path in sorted(files)}


def _texts(data: Any) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, Mapping | list):
        for each in data.values() if isinstance(data, Mapping) else data:
            yield from _texts(each)


def _is(path: Path, what: str) -> bool:
    try:
        return bool(getattr(path, what)())
    except (OSError, ValueError):  # a text that is no path
        return False


def _of_file(path: Path) -> str:
    """A world's by what it says, which takes in the Gazebo models that it includes and leaves out its comments."""
    if worlds.is_file(str(path)):
        try:
            return _short(json.dumps(description.plain(description.load(path)), sort_keys=True, default=str).encode())
        except description.WorldError:  # a plan or an option's file with a world's suffix
            pass
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()[:LENGTH]
    except OSError:  # a program that can be started and not read
        return ""


def _of_code(modules: Sequence[str]) -> str:
    found = {path.resolve(): name for module in modules for name, path in _sources(module)}
    lines = sorted(f"{name} {_short(path.read_bytes())}" for path, name in found.items())
    return _short("\n".join(lines).encode())


def _sources(module: str) -> Iterator[tuple[str, Path]]:
    """The files of a module or a package, by their names in it."""
    spec = find_spec(module)
    if spec is None:
        return
    if spec.submodule_search_locations is None:
        if spec.origin is not None and Path(spec.origin).is_file():
            yield module, Path(spec.origin)
        return
    for place in spec.submodule_search_locations:
        for folder, folders, names in os.walk(place):
            folders[:] = [name for name in folders if name not in SKIPPED and not name.startswith(".")]
            if Path(folder).resolve() == HERE:
                continue
            for path in (Path(folder, name) for name in names):
                if path.suffix in READ and path.is_file():
                    yield f"{module}/{path.relative_to(place).as_posix()}", path


def _short(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:LENGTH]
