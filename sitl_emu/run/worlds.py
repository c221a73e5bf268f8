"""The worlds there are, by kind, and what a run asks of one: origin, terrain, wind, places to start, cameras, truth.

`corn_field` is a field with things to find; `flat` is a level plain without end, for flying without a mission.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from sitl_emu.run.configs import WorldData
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.conditions import LightChange, WindChange
from sitl_emu.world.ground import FlatGround, Terrain
from sitl_emu.world.simulator import Home
from sitl_emu.world.wind import Wind

KINDS = ("corn_field", "flat")
PHOTO_GSD_M = 0.1
PX4_HOME = Home(47.397742, 8.545594, 489.4, 0.0)


class WorldError(Trouble):
    """A world that is unknown or can't be built; the text is one line for people."""


class Place(Protocol):
    """Where a vehicle may start."""

    @property
    def north_m(self) -> float: ...  # noqa: D102
    @property
    def east_m(self) -> float: ...  # noqa: D102
    @property
    def heading_deg(self) -> float: ...  # noqa: D102


@dataclass(frozen=True)
class Spot:
    """A plain place."""

    north_m: float
    east_m: float
    heading_deg: float


@dataclass(frozen=True)
class World:
    """What a run knows of its world."""

    kind: str
    home: Home
    """The world's origin; its heading is of no meaning."""
    terrain: Terrain
    places: dict[str, Place]
    wind: Wind
    truth: dict[str, Any]
    """For scoring and maps: outline, objects, targets."""
    field: Any = None
    """The description that cameras render, where there is one."""


def build(
    kind: str,
    seed: int,
    options: dict[str, Any],
    wind: WindChange | None = None,
    light: LightChange | None = None,
) -> World:
    """A world of a kind, under another wind and light than its own where these are given. Raises WorldError."""
    world = _build(kind, seed, options)
    if wind is not None:
        world = replace(world, wind=Wind(wind.north_m_s, wind.east_m_s, wind.gust_m_s, seed))
    if light is not None:
        if world.field is None:
            raise WorldError(f"world {kind} has no light, as it has nothing that a camera could see")
        field = world.field
        world = replace(world, field=replace(field, light=field.light._replace(**light.given)))
    return world


def of(data: WorldData, seed: int) -> World:
    """The world of a scenario. Raises WorldError."""
    return build(data.kind, seed, dict(data.options), data.wind, data.light)


def _build(kind: str, seed: int, options: dict[str, Any]) -> World:
    if kind not in KINDS:
        raise WorldError(f"there is no world {kind!r}; known: {', '.join(KINDS)}")
    if kind == "flat":
        if options:
            raise WorldError(f"world flat knows no options, not even {next(iter(options))!r}")
        places: dict[str, Place] = {"home": Spot(0.0, 0.0, 0.0)}
        truth: dict[str, Any] = {"outline": [], "objects": []}
        return World("flat", PX4_HOME, FlatGround(), places, Wind(), truth)
    return _corn_field(seed, options)


def photo(world: World) -> np.ndarray | None:
    """The world's outline from straight above, north up, uint8 RGB; None for a world that looks like nothing."""
    if world.field is None:
        return None
    from sitl_emu.world.kinds.corn_field.painter import orthophoto

    return orthophoto(world.field, PHOTO_GSD_M)[:, :, ::-1]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _are_two_numbers(value: object) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(map(_is_number, value))


_CORN_FIELD_OPTIONS: dict[str, tuple[str, Callable[[object], bool]]] = {
    "size_m": ("two numbers, north and east, such as [80, 80]", _are_two_numbers),
    "targets": ("a whole number", _is_count),
    "distractors": ("a whole number", _is_count),
    "growth_stage": ("a whole number", _is_count),
    "relief_m": ("a number", _is_number),
}
"""What `corn_field.build` takes, each with what it must be, in words and as a check."""


def _corn_field(seed: int, options: dict[str, Any]) -> World:
    from sitl_emu.world.kinds.corn_field import field as corn_field

    for name, value in options.items():
        if name not in _CORN_FIELD_OPTIONS:
            raise WorldError(f"world corn_field has no option {name!r}; it knows {', '.join(_CORN_FIELD_OPTIONS)}")
        allowed_value, fits = _CORN_FIELD_OPTIONS[name]
        if not fits(value):
            raise WorldError(f"world corn_field: {name}: {value!r}; must be {allowed_value}")
    wanted = dict(options)
    if "size_m" in wanted:
        wanted["size_m"] = tuple(wanted["size_m"])
    try:
        field = corn_field.build(seed, **wanted)
    except ValueError as error:
        raise WorldError(f"world corn_field: {error}") from None
    home = Home(field.origin_lat_deg, field.origin_lon_deg, field.origin_alt_amsl_m, 0.0)
    objects = [
        {
            "kind": thing.kind,
            "north_m": round(thing.north_m, 3),
            "east_m": round(thing.east_m, 3),
            "radius_m": round(thing.radius_m, 3),
            "target": thing.is_target,
        }
        for thing in field.objects
    ]
    truth = {"outline": [list(corner) for corner in field.outline_m], "objects": objects}
    wind = Wind(field.wind.north_m_s, field.wind.east_m_s, field.wind.gust_m_s, seed)
    places: dict[str, Place] = {"home": field.uas_home, "ugv": field.ugv_start}
    return World("corn_field", home, field.terrain, places, wind, truth, field)
