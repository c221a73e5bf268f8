"""What covers an area of a world, as polygons: land use, water, fire, plants."""

from dataclasses import dataclass
from typing import Annotated

from sitl_emu.vehicles.record import Limits, Words
from sitl_emu.world.description.common import FARTHEST, Colour, Polygon

LAND_USES: dict[str, Colour] = {
    "grass": (0.36, 0.42, 0.23),
    "soil": (0.45, 0.36, 0.27),
    "asphalt": (0.24, 0.24, 0.25),
    "concrete": (0.62, 0.61, 0.58),
    "gravel": (0.52, 0.49, 0.45),
    "sand": (0.76, 0.68, 0.50),
    "rock": (0.50, 0.48, 0.46),
    "mud": (0.35, 0.28, 0.20),
    "forest_floor": (0.30, 0.24, 0.15),
    "charred": (0.10, 0.09, 0.09),
    "snow": (0.93, 0.94, 0.96),
}
"""Names of land uses, each with its mean colour (ours)."""


@dataclass(frozen=True, slots=True)
class LandUse:
    """What the ground is within a polygon; of several on one place, the last one counts."""

    use: Annotated[str, Words(tuple(LAND_USES))]
    polygon_m: Polygon


@dataclass(frozen=True, slots=True)
class Water:
    """Still or flowing water up to a level: where the terrain within the polygon lies below it, as deep as that."""

    name: str
    polygon_m: Polygon
    level_m: Annotated[float, FARTHEST]
    """Height of its surface above the origin."""
    current_north_m_s: Annotated[float, Limits(-20.0, 20.0)] = 0.0
    current_east_m_s: Annotated[float, Limits(-20.0, 20.0)] = 0.0
    label: str = "water"
    colour: Colour = (0.25, 0.29, 0.24)
    """Of deep water."""
    murk_1_m: Annotated[float, Limits(0.0, 1000.0)] = 2.0
    """Extinction of light (Beer and Lambert): the ground at a depth d shows through by exp(-2 murk d)."""


@dataclass(frozen=True, slots=True)
class Smoke:
    """What rises from a fire, to a height, and drifts with the mean wind on its way."""

    height_m: Annotated[float, Limits(0.1, 10_000.0)] = 30.0
    """Over the ground, where it ends."""
    density_1_m: Annotated[float, Limits(0.0, 100.0)] = 0.15
    """Extinction of light at the fire; above it thins out as it widens."""
    rise_m_s: Annotated[float, Limits(0.1, 50.0)] = 3.0
    colour: Colour = (0.42, 0.41, 0.40)


@dataclass(frozen=True, slots=True)
class Fire:
    """Flames within a polygon; with a rate of spread, its front moves to where the mean wind of time 0 blows.

    A place burns from when the front comes, for `burns_s`, and is charred from then on (`fires.py`). In calm air no
    front moves.
    """

    name: str
    polygon_m: Polygon
    """At time 0; convex where it spreads."""
    flame_height_m: Annotated[float, Limits(0.0, 200.0)] = 2.0
    spread_m_s: Annotated[float, Limits(0.0, 30.0)] = 0.0
    burns_s: Annotated[float, Limits(0.0, 1e7)] = 0.0
    """How long a place burns; 0: without end."""
    label: str = "fire"
    colour: Colour = (1.0, 0.45, 0.08)
    smoke: Smoke | None = None


@dataclass(frozen=True, slots=True)
class Cover:
    """Plants that are no solids: cameras see them, and lidar the crowns and the crop, but nothing collides with them.

    Leaves reach from `base_m` to `height_m` over the ground (under a canopy one looks and flies freely; trunks are
    solids, where somebody sets them).
    """

    name: str
    kind: Annotated[str, Words(("grass", "crop", "canopy"))]
    polygon_m: Polygon
    height_m: Annotated[float, Limits(0.01, 100.0)]
    base_m: Annotated[float, Limits(0.0, 100.0)] = 0.0
    density: Annotated[float, Limits(0.0, 1.0)] = 0.9
    """Share of the ground that leaves hide, seen from straight above; the rest are gaps."""
    label: str = ""
    """Empty: its kind."""
    colour: Colour = (0.20, 0.33, 0.13)


@dataclass(frozen=True, slots=True)
class Crop:
    """Rows of corn, north to south, over the world's area."""

    growth_stage: Annotated[int, Limits(5, 8)]
    """Leaves with a collar: 5 for V5, to 8."""
    height_m: Annotated[float, Limits(0.01, 10.0)]
