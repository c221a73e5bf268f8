"""What stands, lies or moves in a world: solids, loose bodies, and things with a label."""

from dataclasses import dataclass
from typing import Annotated

from sitl_emu.vehicles.record import Limits
from sitl_emu.world.description.common import FARTHEST, Colour


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Loose(Solid):
    """A rigid body that falls, tumbles, slides and floats: a parcel, a barrel, a part of a wreck.

    Its mass is spread evenly over its shape; a mesh counts as its convex hull.
    """

    mass_kg: Annotated[float, Limits(0.001, 100_000.0)]
    drag_m2: Annotated[float, Limits(0.0, 1000.0)] = 0.0
    """Drag coefficient times area; the force is ½ ρ drag_m2 v², against the air that it meets."""
    friction: Annotated[float, Limits(0.0, 2.0)] = 0.6
    restitution: Annotated[float, Limits(0.0, 1.0)] = 0.1
    """Share of the closing speed that a bounce leaves."""
    rolling_m: Annotated[float, Limits(0.0, 1.0)] = 0.0
    """How far before its middle what it rolls or spins on pushes back: a soft body's, which is pressed in there."""
    label: str = "parcel"
    colour: Colour = (0.72, 0.53, 0.33)


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
    moves, evenly from waypoint to waypoint, and, if it `repeats`, begins again at the end. It looks where it goes.
    """

    label: str
    north_m: Annotated[float, FARTHEST]
    east_m: Annotated[float, FARTHEST]
    radius_m: Annotated[float, Limits(0.001, 10_000.0)]
    height_m: Annotated[float, Limits(0.0, 1000.0)] = 0.0
    heading_deg: Annotated[float, Limits(-360.0, 360.0)] = 0.0
    """Where it looks while it stands."""
    above_ground_m: Annotated[float, FARTHEST] = 0.0
    """Of the underside of one with a height: on a roof, or afloat."""
    target: bool = False
    name: str = ""
    colour: Colour = (0.75, 0.20, 0.18)
    harmonics: tuple[tuple[float, float], ...] = ()
    """(amplitude, phase in rad) of k = 2, 3, …"""
    seed: int = 0
    """Of what is inside: its plants and shades."""
    path: tuple[Waypoint, ...] = ()
    repeats: bool = False
