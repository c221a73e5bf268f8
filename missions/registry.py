"""The missions there are: found by entry points, so that a package of one's own is one of them once it is installed.

Ours are declared in pyproject.toml like anybody's. In a checkout that file itself is read for them, as the metadata of
an editable installation stays what it was when `pip install -e .` was called. A name that two packages bring is ours,
or the first one's.
"""

import tomllib
from collections.abc import Collection
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from sitl_emu.missions.companion.companion import Companion
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.mission import Mission, Program, Setting

GROUP = "sitl_emu.missions"
CHECKOUT = Path(__file__).resolve().parents[1] / "pyproject.toml"
SCENARIO_SUFFIX = ".yaml"


class MissionError(Exception):
    """A mission that is unknown or was given wrong options; the text is one line for people."""


@cache
def found() -> dict[str, EntryPoint]:
    """The entry points of all missions, by the mission's name."""
    points = dict[str, EntryPoint]()
    for point in (*_declared_here(), *entry_points(group=GROUP)):
        points.setdefault(point.name, point)
    return points


def _declared_here() -> list[EntryPoint]:
    """Those of the checkout that this file lies in, if it does."""
    project = tomllib.loads(CHECKOUT.read_text("utf-8")).get("project", {}) if CHECKOUT.is_file() else {}
    if project.get("name") != "sitl-emu":
        return []
    return [EntryPoint(name, value, GROUP) for name, value in project["entry-points"][GROUP].items()]


@cache
def mission(name: str) -> Mission:
    """The mission of an entry point. Raises MissionError when its package can't be loaded."""
    point = found()[name]
    try:
        loaded = point.load()
    except Exception as error:  # whatever a foreign package does when it is imported
        raise MissionError(f"mission {name}: can't load {point.value}: {type(error).__name__}: {error}") from error
    if not isinstance(loaded, Mission):
        raise MissionError(f"mission {name}: {point.value} is no Mission, but a {type(loaded).__name__}")
    return loaded


def whole() -> dict[str, Mission]:
    """All missions that can be loaded; one that can't does not keep the others from being flown."""
    loaded = dict[str, Mission]()
    for name in found():
        try:
            loaded[name] = mission(name)
        except MissionError:
            continue
    return loaded


def broken() -> list[str]:
    """What is wrong with the missions that can't be loaded, a line each."""
    lines = list[str]()
    for name in found():
        try:
            mission(name)
        except MissionError as error:
            lines.append(str(error))
    return lines


def programs() -> dict[str, Program]:
    """The programs of all missions, by name."""
    return {name: program for one in whole().values() for name, program in one.programs.items()}


def scenarios() -> dict[str, Path]:
    """The scenario files that missions bring, by name."""
    files = dict[str, Path]()
    for one in whole().values():
        if one.scenarios is not None:
            for path in sorted(one.scenarios.glob(f"*{SCENARIO_SUFFIX}")):
                files.setdefault(path.stem, path)
    return files


def prepare(name: str, options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    """The options with which a program is to run in this setting. Raises MissionError."""
    try:
        return _program(name).prepare(options, setting)
    except ValueError as error:
        raise MissionError(f"mission {name}: {error}") from error


def make_companion(name: str, options: dict[str, Any]) -> Companion:
    """The companion of a program's name. Raises MissionError, which names what is wrong and what is allowed.

    `options` come from the scenario file or the command line; each program's module documents its own.
    """
    given = Options(options)
    try:
        companion = _program(name).make(given)
        given.end()
    except ValueError as error:
        raise MissionError(f"mission {name}: {error}") from error
    return companion


def missions_of(names: Collection[str]) -> list[Mission]:
    """The missions whose programs bear these names, each once."""
    return [one for one in whole().values() if not one.programs.keys().isdisjoint(names)]


def modules_of(names: Collection[str]) -> list[str]:
    """The modules of the missions whose programs bear these names."""
    return [found()[name].module for name, one in whole().items() if not one.programs.keys().isdisjoint(names)]


def _program(name: str) -> Program:
    for point in found():
        if name == point or name.startswith(f"{point}-"):
            mission(point)  # its own error says more than that there is no such program
    known = programs()
    if name not in known:
        raise MissionError(f"there is no mission {name!r}; there are: {', '.join(sorted(known))}")
    return known[name]
