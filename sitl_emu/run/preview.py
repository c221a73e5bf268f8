"""`sitl-emu world preview`: what a world looks like, as pictures, a map and its truth in a folder."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sitl_emu.run import folders, views, worlds
from sitl_emu.run.picture_files import png
from sitl_emu.run.views import Look
from sitl_emu.world.camera import Renderer
from sitl_emu.world.description import WorldError
from sitl_emu.world.world import World

WIDTH, HEIGHT = 640, 480
FOCAL_PX = 320.0
"""Of a lens that sees 90 degrees across."""


def picture(renderer: Renderer, world: World, look: Look, time_s: float) -> npt.NDArray[np.uint8]:
    """(HEIGHT, WIDTH, 3) BGR."""
    view = views.view_of(world, look, time_s)
    return renderer.draw(view.place_ned_m, view.camera_to_ned, time_s)


def preview(
    source: str, seed: int, options: Mapping[str, Any], folder: Path, time_s: float, say: Callable[[str], None]
) -> None:
    """Write pictures, map and truth of a world by its kind or file into a new folder. Raises Trouble, OSError."""
    world = worlds.build(source, seed, options)
    try:
        renderer = world.scene().renderer(WIDTH, HEIGHT, FOCAL_PX)
        map_ = world.photo()
    except WorldError as error:
        raise worlds.WorldError(f"{source}: {error}") from None
    folders.make(folder)
    worlds.keep(world, folder)
    (folder / "truth.json").write_text(json.dumps(world.truth(time_s), indent=1) + "\n")
    for look in views.looks(world):
        (folder / f"{look.name}.png").write_bytes(png(picture(renderer, world, look, time_s)))
    if map_ is not None:
        (folder / "map.png").write_bytes(png(map_[:, :, ::-1]))
    for line in worlds.not_read(world):
        say(line)
    say(f"{world.description.name}: pictures, map, truth.json and {worlds.KEPT_AS} are in {folder}")
