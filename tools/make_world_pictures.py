"""Draws docs/worlds/*.jpg: a sheet of pictures of each kind of world, from a photographer's list of views and lights.

    python -m tools.make_world_pictures [KIND ...] [--single DIR]

`--single` writes each picture by itself (PNG) instead, for a close look.
"""

import argparse
import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.run import views, worlds
from sitl_emu.run.views import Look
from sitl_emu.world import kinds
from sitl_emu.world.description import Light
from sitl_emu.world.world import World

Picture = npt.NDArray[np.uint8]
SHEETS = Path(__file__).parents[1] / "docs" / "worlds"
SIZE, FOCAL_PX = (640, 480), 320.0
CELL, COLUMNS = (420, 315), 3
JPEG_QUALITY = 76
SEED, TIME_S = 1, 40.0
HAZY_M = 750.0
"""How far one sees in haze (Light.visibility_m)."""
NIGHT = Light(azimuth_deg=290.0, elevation_deg=0.0, gain=0.6, warmth=0.75)
"""What is left of the light long after sunset."""


class Shot(NamedTuple):
    """One picture of a sheet."""

    title: str
    look: Look
    light: Light | None = None
    """None: the world's own."""
    time_s: float = TIME_S


def at(north: float, east: float, up: float, heading_deg: float, depression_deg: float) -> Look:
    """A look from a place."""
    return Look("", north, east, up, heading_deg, depression_deg)


def towards(north: float, east: float, heading_deg: float, away: float, up: float, depression_deg: float) -> Look:
    """A look at a place, from so far away."""
    h = math.radians(heading_deg)
    return at(north - away * math.cos(h), east - away * math.sin(h), up, heading_deg, depression_deg)


def nadir(north: float, east: float) -> list[Shot]:
    """Straight down on a place."""
    return [Shot(f"nadir {up} m", at(north, east, float(up), 0.0, 90.0)) for up in (5, 15, 30, 60)]


def lights(look: Look, own: Light) -> list[Shot]:
    """The same at dusk, when a camera opens up for a low sun, and in haze."""
    low = dataclasses.replace(own, elevation_deg=6.0, gain=1.75, warmth=1.35)
    return [Shot("dusk", look, low), hazy(look, own)]


def hazy(look: Look, own: Light) -> Shot:
    """The same in haze."""
    return Shot(f"visibility {HAZY_M:.0f} m", look, dataclasses.replace(own, visibility_m=HAZY_M))


def urban_flood(world: World) -> list[Shot]:
    """Over somebody who wades, and along a street."""
    wading = [thing for thing in world.description.things if thing.label == "person" and thing.above_ground_m < 1.5]
    n, e = wading[2].north_m, wading[2].east_m
    on_roof = next(thing for thing in world.description.things if thing.label == "person" and thing.above_ground_m > 5)
    street, size = world.places["street"], world.description.area_m[2][0]
    oblique = towards(0.3 * size, 0.7 * size, 135.0, 75.0, 40.0, 24.0)
    roof = towards(on_roof.north_m, on_roof.east_m, 60.0, 9.0, on_roof.above_ground_m + 6.0, 30.0)
    made = [*nadir(n, e), Shot("oblique", oblique)]
    made.append(Shot("street level", at(street.north_m, street.east_m + 14.0, 1.7, street.heading_deg, 3.0)))
    return [*made, *lights(oblique._replace(depression_deg=17.0), world.description.light), Shot("a roof, 9 m", roof)]


def debris_field(world: World) -> list[Shot]:
    """Over the first ruin, and before it."""
    slab = next(solid for solid in world.description.solids if solid.label == "debris slab")
    n, e, size = slab.north_m, slab.east_m, world.description.area_m[2][0]
    oblique = towards(0.5 * size, 0.5 * size, 30.0, 70.0, 34.0, 25.0)
    made = [*nadir(n, e), Shot("oblique", oblique), Shot("street level", towards(n, e, 200.0, 17.0, 1.7, 0.0))]
    close = towards(n, e, 200.0, 11.0, 8.0, 35.0)
    return [*made, *lights(oblique._replace(depression_deg=17.0), world.description.light), Shot("a ruin, 11 m", close)]


def wildfire_perimeter(world: World) -> list[Shot]:
    """Over the front, before it, and at night."""
    size = world.description.area_m[2][0]
    n, e = 0.40 * size + 9.0, 0.5 * size
    oblique = towards(n, e, 65.0, 45.0, 26.0, 24.0)
    made = [*nadir(n, e), Shot("oblique", oblique), Shot("street level", at(n + 13.0, e, 1.7, 200.0, 0.0))]
    lit = lights(oblique._replace(depression_deg=12.0), world.description.light)
    return [*made, *lit, Shot("fire at night", oblique._replace(depression_deg=14.0), NIGHT)]


def corn_field(world: World) -> list[Shot]:
    """From above, from the rover's mast, and along the rows to the horizon."""
    south, west, north, east = views.extent(world)
    patches = [(thing.north_m, thing.east_m) for thing in world.description.things if thing.target]
    n, e = min(patches, key=lambda each: math.dist(each, (0.5 * (south + north), 0.5 * (west + east))))
    oblique, mast = towards(n, e, 20.0, 14.0, 14.0, 45.0), towards(n, e, 0.0, 2.2, 2.0, 40.0)
    among = towards(n, e, 0.0, 6.0, 0.8, 6.0)
    # Its painter has the gain for how bright a field is, whatever the sun's height
    dusk = dataclasses.replace(world.description.light, elevation_deg=7.0, gain=0.8, warmth=1.14)
    return [
        *nadir(n, e),
        Shot("oblique", oblique),
        Shot("from a mast, 2 m", mast),
        Shot("among the rows", among),
        hazy(towards(n, e, 20.0, 24.0, 13.0, 17.0), world.description.light),
        Shot("dusk", towards(n, e, 20.0, 24.0, 13.0, 17.0), dusk),
    ]


LISTS: dict[str, Callable[[World], list[Shot]]] = {
    "urban_flood": urban_flood,
    "debris_field": debris_field,
    "wildfire_perimeter": wildfire_perimeter,
    "corn_field": corn_field,
}


def drawn(world: World, shot: Shot, scene: Any) -> Picture:
    """(480, 640, 3) BGR."""
    view = views.view_of(world, shot.look, shot.time_s)
    picture: Picture = scene.renderer(*SIZE, FOCAL_PX).draw(view.place_ned_m, view.camera_to_ned, shot.time_s)
    return picture


def pictures(kind: str) -> list[tuple[str, Picture]]:
    """All of a kind, each with its title."""
    made = worlds.build(kind, SEED, {})
    scenes: dict[Light, Any] = {}
    pictures = []
    for shot in LISTS[kind](made):
        light = shot.light or made.description.light
        if light not in scenes:
            scenes[light] = World(dataclasses.replace(made.description, light=light), made.folder, made.terrain).scene()
        pictures.append((shot.title, drawn(made, shot, scenes[light])))
    return pictures


def sheet(pictures: list[tuple[str, Picture]]) -> Picture:
    """In rows, each picture with its title."""
    cells = []
    for title, picture in pictures:
        cell = cv2.resize(picture, CELL, interpolation=cv2.INTER_AREA)
        for shift, colour in ((1, (20, 20, 20)), (0, (250, 250, 250))):
            place = 8 + shift, CELL[1] - 9 + shift
            cv2.putText(cell, title, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, 1, cv2.LINE_AA)
        cells.append(cv2.copyMakeBorder(cell, 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=(255, 255, 255)))
    while len(cells) % COLUMNS:
        cells.append(np.full_like(cells[0], 255))
    rows = [np.hstack(cells[first : first + COLUMNS]) for first in range(0, len(cells), COLUMNS)]
    return np.asarray(np.vstack(rows), np.uint8)


def main() -> None:
    """Draw the kinds that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(LISTS))
    parser.add_argument("--single", type=Path, metavar="DIR")
    asked = parser.parse_args()
    if unknown := set(asked.kinds) - set(LISTS):
        parser.error(f"no list for {', '.join(sorted(unknown))}; there are {', '.join(LISTS)} of {kinds.names()}")
    for kind in asked.kinds or LISTS:
        made = pictures(kind)
        if asked.single is not None:
            asked.single.mkdir(parents=True, exist_ok=True)
            for number, (title, picture) in enumerate(made):
                cv2.imwrite(str(asked.single / f"{kind}_{number}_{title.replace(' ', '_')}.png"), picture)
            continue
        SHEETS.mkdir(exist_ok=True)
        path = SHEETS / f"{kind}.jpg"
        cv2.imwrite(str(path), sheet(made), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY, cv2.IMWRITE_JPEG_OPTIMIZE, 1])
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
