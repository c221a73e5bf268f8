"""`sitl-emu world preview`: what a world looks like, as pictures, a map and its truth in a folder."""

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.run import worlds
from sitl_emu.world.camera import Renderer
from sitl_emu.world.description import Place, WorldError
from sitl_emu.world.world import World

F64 = npt.NDArray[np.float64]
WIDTH, HEIGHT = 640, 480
FOCAL_PX = 320.0
"""Of a lens that sees 90 degrees across."""
FILES = ("map.png", "truth.json", worlds.KEPT_AS)


class Look(NamedTuple):
    """One picture: a place over the ground, and where one looks."""

    name: str
    north_m: float
    east_m: float
    above_m: float
    heading_deg: float
    depression_deg: float


def looks(world: World) -> list[Look]:
    """From straight above at four heights, from the side, and at a person's height where vehicles start."""
    corners = world.description.area_m or ((-40.0, -40.0), (40.0, 40.0))
    south, west = (min(corner[k] for corner in corners) for k in (0, 1))
    north, east = (max(corner[k] for corner in corners) for k in (0, 1))
    n, e = 0.5 * (south + north), 0.5 * (west + east)
    reach = min(0.35 * math.hypot(north - south, east - west), 60.0)
    made = [Look(f"nadir_{height:02d}m", n, e, float(height), 0.0, 90.0) for height in (5, 15, 30, 60)]
    made.append(Look("oblique", n - 0.7 * reach, e - 0.7 * reach, 0.55 * reach, 45.0, 38.0))
    place = _standing(world.places)
    made.append(Look("street", place.north_m, place.east_m, 1.7, place.heading_deg, 3.0))
    return made


def _standing(places: Mapping[str, Place]) -> Place:
    """The place that shows most: not home, if there is another."""
    others = [place for name, place in places.items() if name != "home"]
    return (others or list(places.values()))[0]


def picture(renderer: Renderer, world: World, look: Look, time_s: float) -> npt.NDArray[np.uint8]:
    """(HEIGHT, WIDTH, 3) BGR."""
    h, p = math.radians(look.heading_deg), math.radians(look.depression_deg)
    ahead = np.array((math.cos(p) * math.cos(h), math.cos(p) * math.sin(h), math.sin(p)))
    right = np.array((-math.sin(h), math.cos(h), 0.0))
    up = world.ground(look.north_m, look.east_m) + look.above_m
    place = np.array((look.north_m, look.east_m, -up))
    return renderer.draw(place, np.stack((right, np.cross(ahead, right), ahead), axis=1), time_s)


def preview(
    source: str, seed: int, options: Mapping[str, Any], folder: Path, time_s: float, say: Callable[[str], None]
) -> None:
    """Write pictures, map and truth of a world by its kind or file. Raises worlds.WorldError, OSError."""
    world = worlds.build(source, seed, options)
    folder.mkdir(parents=True, exist_ok=True)
    worlds.keep(world, folder)
    (folder / "truth.json").write_text(json.dumps(world.truth(time_s), indent=1) + "\n")
    try:
        renderer = world.scene().renderer(WIDTH, HEIGHT, FOCAL_PX)
        map_ = world.photo()
    except WorldError as error:
        raise worlds.WorldError(str(error)) from None
    for look in looks(world):
        _write(folder / f"{look.name}.png", picture(renderer, world, look, time_s))
    if map_ is not None:
        _write(folder / "map.png", np.ascontiguousarray(map_[:, :, ::-1]))
    say(f"{world.description.name}: pictures, map, truth.json and {worlds.KEPT_AS} are in {folder}")


def _write(path: Path, image: npt.NDArray[np.uint8]) -> None:
    done, data = cv2.imencode(".png", image)
    assert done
    path.write_bytes(data.tobytes())
