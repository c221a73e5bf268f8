"""Where pictures of a world are taken from: looks, a survey, a table of one's own, what a run's camera saw."""

import csv
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion import calibration
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.camera import body_to_ned, camera_to_body
from sitl_emu.world.description import Place
from sitl_emu.world.lens import Intrinsics, Mount
from sitl_emu.world.world import World

F64 = npt.NDArray[np.float64]
COLUMNS = ("north_m", "east_m", "above_m", "heading_deg", "depression_deg", "time_s")
"""Of a table of views; the last one may be left out."""
TRACK_COLUMNS = ("time_s", "north_m", "east_m", "down_m", "qw", "qx", "qy", "qz")
"""Of a run's true tracks (`recorder.py`), those that are needed."""
MOST_VIEWS = 20_000
HALF_A_TICK_S = 0.002


class Look(NamedTuple):
    """One picture: a place over the ground, and where one looks."""

    name: str
    north_m: float
    east_m: float
    above_m: float
    heading_deg: float
    depression_deg: float


class View(NamedTuple):
    """One picture, as a renderer is asked for it."""

    name: str
    time_s: float
    place_ned_m: F64
    camera_to_ned: F64


def looks(world: World) -> list[Look]:
    """From straight above at four heights, from the side, and at a person's height where vehicles start."""
    south, west, north, east = extent(world)
    n, e = 0.5 * (south + north), 0.5 * (west + east)
    reach = min(0.35 * math.hypot(north - south, east - west), 60.0)
    made = [Look(f"nadir_{height:02d}m", n, e, float(height), 0.0, 90.0) for height in (5, 15, 30, 60)]
    made.append(Look("oblique", n - 0.7 * reach, e - 0.7 * reach, 0.55 * reach, 45.0, 38.0))
    place = _standing(world.places)
    made.append(Look("street", place.north_m, place.east_m, 1.7, place.heading_deg, 3.0))
    return made


def extent(world: World) -> tuple[float, float, float, float]:
    """South, west, north, east of the world's area; where it has none, 40 m around its origin."""
    corners = world.description.area_m or ((-40.0, -40.0), (40.0, 40.0))
    south, west = (min(corner[k] for corner in corners) for k in (0, 1))
    north, east = (max(corner[k] for corner in corners) for k in (0, 1))
    return south, west, north, east


def _standing(places: Mapping[str, Place]) -> Place:
    """The place that shows most: not home, if there is another."""
    others = [place for name, place in places.items() if name != "home"]
    return (others or list(places.values()))[0]


def view_of(world: World, look: Look, time_s: float) -> View:
    """A look at a time; the picture's upper edge points to where one looks, and straight down to the heading."""
    h, p = math.radians(look.heading_deg), math.radians(look.depression_deg)
    ahead = np.array((math.cos(p) * math.cos(h), math.cos(p) * math.sin(h), math.sin(p)))
    right = np.array((-math.sin(h), math.cos(h), 0.0))
    up = world.ground(look.north_m, look.east_m) + look.above_m
    place = np.array((look.north_m, look.east_m, -up))
    return View(look.name, time_s, place, np.stack((right, np.cross(ahead, right), ahead), axis=1))


def survey(world: World, height_m: float, overlap: float, lens: Intrinsics) -> list[Look]:
    """Straight down from a height over ground, line by line over the whole area, each other line backwards.

    `overlap`: the share of a picture that its neighbours show, too. Raises Trouble where it takes too many.
    """
    south, west, north, east = extent(world)
    metre_px = height_m / lens.focal_px * (1.0 - overlap)
    along, across = _steps(south, north, lens.height * metre_px), _steps(west, east, lens.width * metre_px)
    if len(along) * len(across) > MOST_VIEWS:
        raise Trouble(
            f"--survey {height_m:g}: {len(along) * len(across)} pictures; {MOST_VIEWS} are allowed: go higher"
        )
    made = list[Look]()
    for number, line in enumerate(across):
        for n in along if number % 2 == 0 else along[::-1]:
            made.append(Look(f"{len(made):06d}", n, line, height_m, 0.0, 90.0))
    return made


def _steps(first: float, last: float, step: float) -> list[float]:
    """Evenly spaced, no further apart than a step, half a gap from either end."""
    count = max(math.ceil((last - first) / step), 1)
    gap = (last - first) / count
    return [first + (k + 0.5) * gap for k in range(count)]


def read(path: Path, world: World, time_s: float) -> list[View]:
    """Views of a table (CSV) with the columns COLUMNS; `time_s` where it has none. Raises Trouble."""
    made = list[View]()
    for number, row in _rows(path, COLUMNS[:-1], COLUMNS):
        n, e, above, heading, depression = (row[name] for name in COLUMNS[:-1])
        if above <= 0.0 or abs(depression) > 90.0:
            raise Trouble(f"{path}: line {number}: above_m must be above 0, and depression_deg -90 to 90")
        look = Look(f"{len(made):06d}", n, e, above, heading, depression)
        made.append(view_of(world, look, row.get("time_s", time_s)))
    if not made:
        raise Trouble(f"{path}: there are no views in it; its columns are {','.join(COLUMNS)}")
    return made


def _rows(path: Path, needed: tuple[str, ...], known: tuple[str, ...]) -> Iterator[tuple[int, dict[str, float]]]:
    """Each with its line's number. Raises Trouble."""
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise Trouble(f"{path}: can't be read: {getattr(error, 'strerror', None) or 'not text'}") from None
    table = csv.DictReader(text.splitlines(), restval="")
    if missing := [name for name in needed if name not in (table.fieldnames or ())]:
        raise Trouble(f"{path}: has no column {missing[0]!r}; needed are {','.join(needed)}")
    for row in table:
        try:
            values = {name: float(row[name]) for name in known if name in row}
        except ValueError:
            values = {}
        if not values or not all(math.isfinite(each) for each in values.values()):
            raise Trouble(f"{path}: line {table.line_num}: must be numbers")
        yield table.line_num, values


class Flown(NamedTuple):
    """What a camera of a finished run saw."""

    vehicle: str
    lens: Intrinsics
    """Without the lens' distortion."""
    views: list[View]
    on_gimbal: bool
    """Then it is taken as looking straight down from a level gimbal: a run does not keep where it looked."""


def of_run(folder: Path, vehicle: str | None, every_s: float) -> Flown:
    """Where the camera of a run's vehicle was, every so many seconds. Raises Trouble."""
    known = sorted(path.name.removesuffix("-camera.yaml") for path in folder.glob("*-camera.yaml"))
    if not known:
        raise Trouble(f"{folder}: no vehicle of this run has a camera; give --survey or --views")
    name = vehicle or known[0]
    if name not in known:
        raise Trouble(f"--vehicle {name}: {folder} has no camera of it; it has those of {', '.join(known)}")
    try:
        camera, mount = calibration.read(folder / f"{name}-camera.yaml")
    except ValueError as error:
        raise Trouble(str(error)) from None
    lens = Intrinsics(camera.width, camera.height, math.degrees(2.0 * math.atan2(0.5 * camera.width, camera.fx)))
    on_gimbal = mount is not None and mount.on_gimbal
    where = Mount(0.0, 0.0, 0.0, 90.0) if mount is None else Mount(*mount[:3], 90.0 if on_gimbal else mount[3])
    made: list[View] = []
    for _, row in _rows(folder / f"truth-{name}.csv", TRACK_COLUMNS, TRACK_COLUMNS):
        if not made or row["time_s"] >= made[-1].time_s + every_s - HALF_A_TICK_S:
            made.append(_on_board(row, where, on_gimbal, f"{name}_{round(row['time_s'] * 1000):09d}"))
    if not made:
        raise Trouble(f"{folder / f'truth-{name}.csv'}: there is nothing in it")
    return Flown(name, lens, made, on_gimbal)


def _on_board(row: Mapping[str, float], mount: Mount, is_level: bool, name: str) -> View:
    turn = body_to_ned((row["qw"], row["qx"], row["qy"], row["qz"]))
    place = np.array((row["north_m"], row["east_m"], row["down_m"])) + turn @ np.array(mount[:3])
    if is_level:
        heading = math.atan2(turn[1, 0], turn[0, 0])
        s, c = math.sin(heading), math.cos(heading)
        turn = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    return View(name, row["time_s"], place, turn @ camera_to_body(mount))
