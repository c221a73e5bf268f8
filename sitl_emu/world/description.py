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

FORMAT = 1
GROUND = "ground"
"""What a hit on the terrain is called, and so no solid."""
FARTHEST = Limits(-100_000.0, 100_000.0)
Colour = Annotated[tuple[float, float, float], Limits(0.0, 1.0)]
"""Red, green, blue."""


class WorldError(Exception):
    """A world that is unknown, wrong or can't be built; the text is one line for people."""


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
class Box:
    """A cuboid: its extent to north and east (before it is turned) and upwards."""

    size_m: Annotated[tuple[float, float, float], Limits(0.001, 10_000.0)]


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder."""

    radius_m: Annotated[float, Limits(0.001, 10_000.0)]
    height_m: Annotated[float, Limits(0.001, 10_000.0)]


@dataclass(frozen=True, slots=True)
class Hull:
    """The convex hull of points (north, east, up) about the solid's place."""

    points_m: Annotated[tuple[tuple[float, float, float], ...], FARTHEST]


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles from an OBJ, STL, PLY or glTF file (x forward, y left, z up; glTF as its standard has it)."""

    file: str
    scale: Annotated[float, Limits(1e-6, 1e6)] = 1.0


@dataclass(frozen=True, slots=True)
class Solid:
    """Something that stands: exactly one shape, at a place, its underside `above_ground_m` over the ground there."""

    name: str
    north_m: Annotated[float, FARTHEST]
    east_m: Annotated[float, FARTHEST]
    heading_deg: Annotated[float, Limits(-360.0, 360.0)] = 0.0
    pitch_deg: Annotated[float, Limits(-180.0, 180.0)] = 0.0
    roll_deg: Annotated[float, Limits(-180.0, 180.0)] = 0.0
    above_ground_m: Annotated[float, FARTHEST] = 0.0
    label: str = "building"
    colour: Colour = (0.62, 0.60, 0.57)
    box: Box | None = None
    cylinder: Cylinder | None = None
    hull: Hull | None = None
    mesh: Mesh | None = None


@dataclass(frozen=True, slots=True)
class Waypoint:
    """Where a moving thing is at a time."""

    at_s: Annotated[float, Limits(0.0, 1e7)]
    north_m: Annotated[float, FARTHEST]
    east_m: Annotated[float, FARTHEST]


@dataclass(frozen=True, slots=True)
class Thing:
    """Something with a label, to be found (`target`) or to be mistaken for it: a patch, a person, a vehicle.

    With a height it is an upright cylinder that can be met; with none it lies on the ground. Its outline is
    r(a) = radius_m · (1 + Σ amplitude · cos(k a + phase)), k counted from 2, a from north over east. With a `path` it
    moves, evenly from waypoint to waypoint, and, if it `repeats`, begins again at the end.
    """

    label: str
    north_m: Annotated[float, FARTHEST]
    east_m: Annotated[float, FARTHEST]
    radius_m: Annotated[float, Limits(0.001, 10_000.0)]
    height_m: Annotated[float, Limits(0.0, 1000.0)] = 0.0
    target: bool = False
    name: str = ""
    colour: Colour = (0.75, 0.20, 0.18)
    harmonics: tuple[tuple[float, float], ...] = ()
    """(amplitude, phase in rad) of k = 2, 3, …"""
    seed: int = 0
    """Of what is inside: its plants and shades."""
    path: tuple[Waypoint, ...] = ()
    repeats: bool = False


@dataclass(frozen=True, slots=True)
class Crop:
    """Rows of corn, north to south, over the world's area."""

    growth_stage: Annotated[int, Limits(5, 8)]
    """Leaves with a collar: 5 for V5, to 8."""
    height_m: Annotated[float, Limits(0.01, 10.0)]


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
    """The sun, and the exposure it leaves a camera with."""

    azimuth_deg: Annotated[float, Limits(-360.0, 360.0)] = 135.0
    elevation_deg: Annotated[float, Limits(0.0, 90.0)] = 50.0
    gain: Annotated[float, Limits(0.01, 10.0)] = 1.2
    warmth: Annotated[float, Limits(0.1, 10.0)] = 1.0
    """Red over blue balance: above 1 is a low, warm sun."""


@dataclass(frozen=True, slots=True)
class Ground:
    """What the ground looks like: one colour, or a photo from straight above (north up, `gsd_m` a pixel)."""

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
    area_m: tuple[tuple[float, float], ...] = ()
    """Corners (north, east) of what a mission is about; a map shows it."""
    terrain: Terrain = Terrain()
    ground: Ground = Ground()
    solids: tuple[Solid, ...] = ()
    things: tuple[Thing, ...] = ()
    crop: Crop | None = None
    wind: Wind = Wind()
    light: Light = Light()


def load(path: Path) -> WorldDescription:
    """Read a world file. Raises WorldError, which names file, field, value and what is allowed."""
    try:
        data = yaml.safe_load(path.read_text())
    except OSError as error:
        raise WorldError(f"{path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise WorldError(f"{path}: not YAML: {' '.join(str(error).split())}") from None
    if not isinstance(data, Mapping):
        fields = ", ".join(field.name for field in dataclasses.fields(WorldDescription))
        raise WorldError(f"{path}: a world is a mapping with the fields {fields}")
    return read(data, str(path))


def read(data: Mapping[str, Any], where: str) -> WorldDescription:
    """A description from plain data; `where` names its source in errors. Raises WorldError."""
    try:
        described = record.read(WorldDescription, data, where)
    except VehicleError as error:
        raise WorldError(str(error)) from None
    for number, solid in enumerate(described.solids):
        shapes = [shape for shape in (solid.box, solid.cylinder, solid.hull, solid.mesh) if shape is not None]
        if len(shapes) != 1:
            raise WorldError(f"{where}: solids[{number}] {solid.name!r}: give one of box, cylinder, hull, mesh")
    names = {GROUND}
    for number, solid in enumerate(described.solids):
        if solid.name in names:
            raise WorldError(f"{where}: solids[{number}]: name = {solid.name!r}: another has this name")
        names.add(solid.name)
    for number, thing in enumerate(described.things):
        times = [waypoint.at_s for waypoint in thing.path]
        if sorted(set(times)) != times:
            raise WorldError(f"{where}: things[{number}].path: at_s must grow from waypoint to waypoint, not {times}")
    if not described.places:
        raise WorldError(f"{where}: places: name at least one, such as home: {{north_m: 0, east_m: 0}}")
    return described


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
