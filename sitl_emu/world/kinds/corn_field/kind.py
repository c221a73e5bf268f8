"""The corn field as a kind of world: its options, its description, and what cameras and maps see of it."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from sitl_emu.world import description as d
from sitl_emu.world.kinds import Generated
from sitl_emu.world.kinds.corn_field import field as corn_field
from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.objects import FieldObject
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.kinds.corn_field.visitors import is_painted
from sitl_emu.world.terrain import HeightMap
from sitl_emu.world.world import World

TERRAIN_FILE = "terrain.npy"
PHOTO_GSD_M = 0.1


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _are_two_numbers(value: object) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(map(_is_number, value))


OPTIONS: dict[str, tuple[str, Callable[[object], bool]]] = {
    "size_m": ("two numbers, north and east, such as [80, 80]", _are_two_numbers),
    "targets": ("a whole number", _is_count),
    "distractors": ("a whole number", _is_count),
    "growth_stage": ("a whole number", _is_count),
    "relief_m": ("a number", _is_number),
}
"""What `field.build` takes, each with what it must be, in words and as a check."""


def generate(seed: int, options: Mapping[str, Any]) -> Generated:
    """See kinds; the options are OPTIONS."""
    for name, value in options.items():
        if name not in OPTIONS:
            raise d.WorldError(f"world corn_field has no option {name!r}; it knows {', '.join(OPTIONS)}")
        allowed_value, fits = OPTIONS[name]
        if not fits(value):
            raise d.WorldError(f"world corn_field: {name}: {value!r}; must be {allowed_value}")
    wanted = dict(options)
    if "size_m" in wanted:
        wanted["size_m"] = tuple(wanted["size_m"])
    try:
        built = corn_field.build(seed, **wanted)
    except ValueError as error:
        raise d.WorldError(f"world corn_field: {error}") from None
    return Generated(description_of(built), built.terrain)


def description_of(built: CornField) -> d.WorldDescription:
    """A field as a world file has it."""
    terrain = built.terrain
    return d.WorldDescription(
        name="corn_field",
        kind="corn_field",
        seed=built.seed,
        origin=d.Origin(built.origin_lat_deg, built.origin_lon_deg, built.origin_alt_amsl_m),
        places={"home": d.Place(*built.uas_home), "ugv": d.Place(*built.ugv_start)},
        area_m=built.outline_m,
        terrain=d.Terrain(
            file=TERRAIN_FILE, north0_m=terrain.north0_m, east0_m=terrain.east0_m, spacing_m=terrain.spacing_m
        ),
        things=tuple(
            d.Thing(
                thing.kind, thing.north_m, thing.east_m, thing.radius_m,
                target=thing.is_target, harmonics=thing.harmonics, seed=thing.seed,
            )
            for thing in built.objects
        ),
        crop=d.Crop(built.growth_stage, built.plant_height_m),
        wind=d.Wind(*built.wind),
        light=built.light,
    )  # fmt: skip


def field_of(world: World) -> CornField:
    """The field that a world of this kind is. Raises WorldError for a world file that was changed beyond that."""
    described, terrain = world.description, world.terrain
    if described.crop is None or not isinstance(terrain, HeightMap) or not {"home", "ugv"} <= described.places.keys():
        raise d.WorldError(
            f"world {described.name}: a corn_field has a crop, terrain from a file, and the places home and ugv; "
            "leave out `kind` for a world of your own"
        )
    home, ugv = described.places["home"], described.places["ugv"]
    return CornField(
        seed=described.seed,
        size_m=(max(corner[0] for corner in described.area_m), max(corner[1] for corner in described.area_m)),
        origin_lat_deg=described.origin.lat_deg,
        origin_lon_deg=described.origin.lon_deg,
        origin_alt_amsl_m=described.origin.alt_amsl_m,
        terrain=terrain,
        objects=tuple(
            FieldObject(thing.label, thing.north_m, thing.east_m, thing.radius_m, thing.harmonics, thing.seed)
            for thing in described.things
            if is_painted(thing)
        ),
        growth_stage=described.crop.growth_stage,
        plant_height_m=described.crop.height_m,
        uas_home=corn_field.Place(home.north_m, home.east_m, home.heading_deg),
        ugv_start=corn_field.Place(ugv.north_m, ugv.east_m, ugv.heading_deg),
        wind=corn_field.Wind(described.wind.north_m_s, described.wind.east_m_s, described.wind.gust_m_s),
        light=described.light,
    )


def scene(world: World, shared_memory: int | None) -> FieldScene:
    """For cameras. Raises WorldError."""
    return FieldScene(field_of(world), shared_memory, world.description.things)


def photo(world: World) -> npt.NDArray[np.uint8]:
    """The field from straight above, north up, uint8 RGB. Raises WorldError."""
    from sitl_emu.world.kinds.corn_field.painter import orthophoto

    return np.asarray(orthophoto(field_of(world), PHOTO_GSD_M)[:, :, ::-1], np.uint8)
