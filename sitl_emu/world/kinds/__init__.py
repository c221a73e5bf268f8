"""Kinds of worlds that are generated from options and a seed, a package each; nothing else names one of them.

A package `NAME` holds a module `kind` with `generate(seed, options) -> Generated`, which raises WorldError for what it
can't build, and, where `render` does not do, `scene(world, shared_memory)` for cameras (see `World.scene`) and
`photo(world)` for maps.
"""

import importlib
import pkgutil
from types import ModuleType
from typing import NamedTuple

from sitl_emu.world.description import WorldDescription, WorldError
from sitl_emu.world.ground import Terrain


class Generated(NamedTuple):
    """A world as its kind made it: the description, and the heights that its `terrain.file` is to hold."""

    description: WorldDescription
    terrain: Terrain | None = None


def names() -> list[str]:
    """The kinds that there are."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def kind(name: str) -> ModuleType:
    """The module of a kind. Raises WorldError."""
    if name not in names():
        raise WorldError(f"there is no world {name!r}; known: {', '.join(names())}, or a world file (.yaml)")
    return importlib.import_module(f"{__name__}.{name}.kind")
