"""What a world *is*, as plain data: the records that a world file (YAML) is read into, and written from.

Physics, lidar, camera, truth, scoring and maps follow from it (`world.py`). Kinds of worlds (`kinds/`) generate one
from options and a seed; users write one by hand. Frame: metres north and east of the world's origin, heights up from
it; headings in degrees from north over east. Files that it names lie beside it.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import yaml

from sitl_emu.vehicles import record
from sitl_emu.vehicles.errors import VehicleError
from sitl_emu.vehicles.record import Limits, Words
from sitl_emu.world import sdf
from sitl_emu.world.description import checks, yaml_text
from sitl_emu.world.description.areas import LAND_USES as LAND_USES
from sitl_emu.world.description.areas import Cover as Cover
from sitl_emu.world.description.areas import Crop as Crop
from sitl_emu.world.description.areas import Fire as Fire
from sitl_emu.world.description.areas import LandUse as LandUse
from sitl_emu.world.description.areas import Smoke as Smoke
from sitl_emu.world.description.areas import Water as Water
from sitl_emu.world.description.bodies import Box as Box
from sitl_emu.world.description.bodies import Cylinder as Cylinder
from sitl_emu.world.description.bodies import Hull as Hull
from sitl_emu.world.description.bodies import Loose as Loose
from sitl_emu.world.description.bodies import Mesh as Mesh
from sitl_emu.world.description.bodies import Solid as Solid
from sitl_emu.world.description.bodies import Thing as Thing
from sitl_emu.world.description.bodies import Waypoint as Waypoint
from sitl_emu.world.description.common import FARTHEST as FARTHEST
from sitl_emu.world.description.common import GROUND as GROUND
from sitl_emu.world.description.common import Colour as Colour
from sitl_emu.world.description.common import Polygon as Polygon
from sitl_emu.world.description.common import WorldError as WorldError

FORMAT = 1


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the world's origin lies on Earth (WGS 84; altitude above mean sea level)."""

    lat_deg: Annotated[float, Limits(-89.0, 89.0)] = 47.397742
    lon_deg: Annotated[float, Limits(-180.0, 180.0)] = 8.545594
    alt_amsl_m: Annotated[float, Limits(-500.0, 9000.0)] = 489.4


@dataclass(frozen=True, slots=True)
class Place:
    """A place to stand, and where one looks from it."""

    north_m: Annotated[float, FARTHEST]
    east_m: Annotated[float, FARTHEST]
    heading_deg: Annotated[float, Limits(-360.0, 360.0)] = 0.0


@dataclass(frozen=True, slots=True)
class Terrain:
    """The ground's heights: level at `height_m`, or from a file.

    `.npy`: metres above the origin, float, rows from south to north. `.png`: 8 or 16 bit, from `low_m` (black) to
    `high_m` (white), the top row in the north, as a map. Both begin at (`north0_m`, `east0_m`), the south-west corner,
    a height every `spacing_m`. `.tif`: a GeoTIFF in longitude and latitude, which says itself where it lies; its
    heights are above mean sea level (`datum: amsl`), or above the ellipsoid, which here lies `geoid_m` below the sea.
    """

    height_m: Annotated[float, FARTHEST] = 0.0
    file: str = ""
    north0_m: Annotated[float, FARTHEST] = 0.0
    east0_m: Annotated[float, FARTHEST] = 0.0
    spacing_m: Annotated[float, Limits(0.01, 1000.0)] = 1.0
    low_m: Annotated[float, FARTHEST] = 0.0
    high_m: Annotated[float, FARTHEST] = 0.0
    datum: Annotated[str, Words(("amsl", "ellipsoid"))] = "amsl"
    geoid_m: Annotated[float, Limits(-120.0, 100.0)] = 0.0
    """Height of mean sea level above the ellipsoid (the geoid undulation)."""
    no_data_m: Annotated[float, FARTHEST] = 0.0
    """Height above the origin where a file has none (NaN, or the no-data value that a GeoTIFF names)."""


@dataclass(frozen=True, slots=True)
class WindChange:
    """The mean wind from a time on; between two changes it goes evenly from one to the next."""

    at_s: Annotated[float, Limits(0.0, 1e7)]
    north_m_s: Annotated[float, Limits(-60.0, 60.0)]
    east_m_s: Annotated[float, Limits(-60.0, 60.0)]


@dataclass(frozen=True, slots=True)
class Wind:
    """Mean wind, where it blows to, the standard deviation of its gusts, and how it grows with height.

    At a height h over ground the mean is (h / `reference_height_m`) ** `profile_exponent` times the given one; exponent
    0: the same everywhere, 1/7: open land.
    """

    north_m_s: Annotated[float, Limits(-60.0, 60.0)] = 0.0
    east_m_s: Annotated[float, Limits(-60.0, 60.0)] = 0.0
    gust_m_s: Annotated[float, Limits(0.0, 30.0)] = 0.0
    profile_exponent: Annotated[float, Limits(0.0, 1.0)] = 0.0
    reference_height_m: Annotated[float, Limits(0.1, 1000.0)] = 10.0
    changes: tuple[WindChange, ...] = ()


@dataclass(frozen=True, slots=True)
class Light:
    """The sun, the exposure it leaves a camera with, and how far one sees."""

    azimuth_deg: Annotated[float, Limits(-360.0, 360.0)] = 135.0
    elevation_deg: Annotated[float, Limits(0.0, 90.0)] = 50.0
    gain: Annotated[float, Limits(0.01, 10.0)] = 1.2
    warmth: Annotated[float, Limits(0.1, 10.0)] = 1.0
    """Red over blue balance: above 1 is a low, warm sun."""
    visibility_m: Annotated[float, Limits(20.0, 1e6)] = 7500.0
    """Meteorological optical range: how far a light goes until the air leaves a twentieth of it (WMO-No. 8). The
    default, a summer's day over land, is ours."""


@dataclass(frozen=True, slots=True)
class Ground:
    """What the ground looks like: one land use or colour, others within polygons, or a photo from straight above.

    Where a photo (north up, `gsd_m` a pixel) reaches, it counts, but for polygons, which lie on it.
    """

    use: Annotated[str, Words(("", *LAND_USES))] = ""
    """A land use; empty: plain `colour`."""
    land: tuple[LandUse, ...] = ()
    colour: Colour = (0.36, 0.42, 0.24)
    orthophoto: str = ""
    north0_m: Annotated[float, FARTHEST] = 0.0
    east0_m: Annotated[float, FARTHEST] = 0.0
    """The photo's south-west corner."""
    gsd_m: Annotated[float, Limits(0.001, 100.0)] = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldDescription:
    """One world."""

    format: Annotated[int, Limits(FORMAT, FORMAT)] = FORMAT
    name: str
    kind: str = ""
    """The package of `kinds/` that draws it; empty: it is drawn from this description alone."""
    seed: Annotated[int, Limits(0)] = 0
    origin: Origin = Origin()
    places: Mapping[str, Place] = dataclasses.field(default_factory=lambda: {"home": Place(0.0, 0.0)})
    area_m: Polygon = ()
    """What a mission is about; a map shows it."""
    terrain: Terrain = Terrain()
    ground: Ground = Ground()
    solids: tuple[Solid, ...] = ()
    loose: tuple[Loose, ...] = ()
    things: tuple[Thing, ...] = ()
    water: tuple[Water, ...] = ()
    fires: tuple[Fire, ...] = ()
    cover: tuple[Cover, ...] = ()
    crop: Crop | None = None
    wind: Wind = Wind()
    light: Light = Light()
    not_read: tuple[str, ...] = ()
    """What of a Gazebo world is not in it (`sdf/`), for people."""


def load(path: Path) -> WorldDescription:
    """Read a world file, ours or Gazebo's. Raises WorldError, which names file, field, value and what is allowed."""
    if path.suffix in sdf.SUFFIXES:
        return read(sdf.read(path), str(path))
    try:
        data = yaml_text.load(path.read_text("utf-8"))
    except OSError as error:
        raise WorldError(f"{path}: {error.strerror}") from None
    except yaml_text.YamlError as error:
        raise WorldError(f"{path}: {error}") from None
    except ValueError as error:  # no UTF-8
        raise WorldError(f"{path}: not YAML: {error}") from None
    if not isinstance(data, Mapping):
        fields = ", ".join(field.name for field in dataclasses.fields(WorldDescription))
        raise WorldError(f"{path}: a world is a mapping with the fields {fields}")
    described = read(sdf.joined(data, path) if "sdf" in data else data, str(path))
    checks.check_files(_own(data, described, str(path)), str(path))
    return described


def _own(data: Mapping[str, Any], described: WorldDescription, where: str) -> WorldDescription:
    """What a world file itself describes, without the Gazebo world that it may name."""
    if "sdf" not in data:
        return described
    return read({"name": described.name, **{field: data[field] for field in data if field != "sdf"}}, where)


def read(data: Mapping[str, Any], where: str) -> WorldDescription:
    """A description from plain data; `where` names its source in errors. Raises WorldError."""
    try:
        described = record.read(WorldDescription, data, where)
    except VehicleError as error:
        raise WorldError(str(error)) from None
    checks.check(described, where)
    return described


def things_of(data: Any, where: str) -> tuple[Thing, ...]:
    """Things from plain data; `where` names its source in errors. Raises WorldError."""
    return read({"name": "things", "things": data}, where).things


def loose_of(data: Mapping[str, Any]) -> Loose:
    """A loose body of what `plain` made of it."""
    return record.read(Loose, data, "loose")


def save(described: WorldDescription, path: Path) -> None:
    """Write a world file; what it holds is what `load` reads, to the last digit."""
    path.write_text(yaml.safe_dump(plain(described), sort_keys=False, default_flow_style=None, width=120))


def plain(value: Any) -> Any:
    """A record as YAML has it: mappings, lists and scalars, without what is as it is by default."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: plain(getattr(value, field.name))
            for field in dataclasses.fields(value)
            if getattr(value, field.name) != _default(field)
        }
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    return [plain(each) for each in value] if isinstance(value, tuple) else value


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return dataclasses.MISSING
    return field.default
