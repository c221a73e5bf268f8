"""What the data set is drawn from: worlds of three kinds, changed in ground, water, rubble, flames and light by a seed.

Two sets are held out of training: `asset` has water, rubble, flames and ground of makes that training has not, `light`
a low warm sun, haze and other exposures. All ranges are ours.
"""

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np

from sitl_emu.world import description as d
from sitl_emu.world import kinds
from sitl_emu.world.ground import Terrain
from sitl_emu.world.solids import Solids

Rng = np.random.Generator
Colour = tuple[float, float, float]
KINDS = ("urban_flood", "debris_field", "wildfire_perimeter")
FAMILIES = ("usual", "asset", "light")

WATERS: tuple[tuple[Colour, float], ...] = (
    ((0.40, 0.33, 0.23), 9.4), ((0.33, 0.31, 0.24), 6.0), ((0.25, 0.29, 0.24), 4.4), ((0.46, 0.40, 0.30), 19.0),
)  # fmt: skip
"""Colours of deep water, and murk (1/m): at 100, 50, 30 and 300 FNU, as urban_flood's kind.MURK_1_M is reckoned."""
OTHER_WATERS: tuple[tuple[Colour, float], ...] = (((0.10, 0.22, 0.24), 4.4), ((0.09, 0.10, 0.08), 9.4))
GROUNDS = ("grass", "soil", "forest_floor", "gravel")
OTHER_GROUNDS = ("mud", "sand")
TINTED_RUBBLE: tuple[Colour, ...] = (
    (0.66, 0.56, 0.40), (0.28, 0.32, 0.38), (0.17, 0.17, 0.18), (0.40, 0.44, 0.33), (0.55, 0.67, 0.70),
    (0.75, 0.62, 0.32), (0.70, 0.54, 0.50),
)  # fmt: skip
"""Sandstone, slate, roofing felt, concrete under moss, and walls painted blue, yellow and pink."""
OTHER_RUBBLE: tuple[Colour, ...] = ((0.58, 0.26, 0.17), (0.50, 0.36, 0.22), (0.82, 0.80, 0.76))
"""Brick, wood, plaster."""
TINTED = 0.5
"""Share of the usual worlds in which some pieces of ruins are tinted: of other makes a network that had seen grey ones
alone found a fifth."""
USUAL_SUN_DEG = (17.0, 65.0)
USUAL_HAZE = (0.5, 3.0)
"""Extinction in 1/2500 m: one sees 15 to 2.5 km."""
FLAMES_M, OTHER_FLAMES_M = (0.9, 3.0), (4.0, 6.5)


@dataclasses.dataclass
class Drawn:
    """A world as the renderer reads it (`render.scene.Seen`), and how much haze lies in it."""

    description: d.WorldDescription
    terrain: Terrain
    haze_1_m: float
    solids: Solids | None = None
    """None: nothing collides."""


def world(number: int, family: str, seed: int) -> Drawn:
    """World `number` of a family; the kinds come in turn, and one in eight has lost what is looked for."""
    kind = KINDS[number % len(KINDS)]
    rng = np.random.default_rng((seed, number, FAMILIES.index(family), 11))
    options = _options(kind, family, rng)
    made = kinds.kind(kind).generate(int(rng.integers(1, 1_000_000)), options)
    assert made.terrain is not None
    other = family == "asset"
    described = _light(made.description, family == "light", rng)
    described = _ground(described, other, rng)
    described = _waters(described, other, rng)
    described = _rubble(described, other, rng)
    if number // len(KINDS) % 8 == 7:
        kept = tuple(solid for solid in described.solids if not solid.label.startswith("debris"))
        described = dataclasses.replace(described, water=(), fires=(), solids=kept)
    haze = float(rng.uniform(4.0, 14.0)) if family == "light" else float(rng.uniform(*USUAL_HAZE))
    return Drawn(described, made.terrain, haze / 2500.0)


def _options(kind: str, family: str, rng: Rng) -> dict[str, Any]:
    if kind == "urban_flood":
        return {"size_m": 120.0, "flood_m": float(rng.uniform(0.3, 1.4))}
    if kind == "debris_field":
        return {"size_m": 110.0, "ruins": int(rng.integers(4, 10)), "rubble": int(rng.integers(80, 260))}
    low, high = OTHER_FLAMES_M if family == "asset" else FLAMES_M
    return {"size_m": 120.0, "flame_height_m": float(rng.uniform(low, high)), "wind_m_s": float(rng.uniform(1, 7))}


def _light(described: d.WorldDescription, is_other: bool, rng: Rng) -> d.WorldDescription:
    if is_other:
        light = d.Light(float(rng.uniform(0, 360)), float(rng.uniform(6, 15)), float(rng.uniform(1.0, 1.7)),
                        float(rng.uniform(1.2, 1.6)))  # fmt: skip
    else:
        light = d.Light(float(rng.uniform(0, 360)), _usual_sun_deg(rng), float(rng.uniform(0.95, 1.4)),
                        float(rng.uniform(0.9, 1.2)))  # fmt: skip
    return dataclasses.replace(described, light=light)


def _usual_sun_deg(rng: Rng) -> float:
    """Its height: half of the suns lower than 31 degrees, as shade is what is hard to see in."""
    low, high = USUAL_SUN_DEG
    return low + (high - low) * float(rng.random()) ** 1.8


def _ground(described: d.WorldDescription, is_other: bool, rng: Rng) -> d.WorldDescription:
    """Other uses for grass and soil."""
    uses = OTHER_GROUNDS if is_other else GROUNDS
    swap = {use: str(rng.choice(uses)) for use in ("grass", "soil")} if is_other or rng.random() < 0.5 else {}
    ground = described.ground
    land = tuple(dataclasses.replace(each, use=swap.get(each.use, each.use)) for each in ground.land)
    return dataclasses.replace(
        described, ground=dataclasses.replace(ground, use=swap.get(ground.use, ground.use), land=land)
    )


def _waters(described: d.WorldDescription, is_other: bool, rng: Rng) -> d.WorldDescription:
    of = OTHER_WATERS if is_other else WATERS
    colour, murk = of[int(rng.integers(len(of)))]
    colour = _near(colour, rng, 0.04)
    water = tuple(dataclasses.replace(each, colour=colour, murk_1_m=murk) for each in described.water)
    return dataclasses.replace(described, water=water)


def _rubble(described: d.WorldDescription, is_other: bool, rng: Rng) -> d.WorldDescription:
    """Usual rubble is of irregular pieces, grey or tinted; other rubble of brick, wood, plaster, with square edges."""
    bright = float(rng.uniform(0.75, 1.2))
    tinted = float(rng.uniform(0.2, 1.0)) if rng.random() < TINTED else 0.0
    solids = []
    for solid in described.solids:
        changed = solid
        if solid.label.startswith("debris") and is_other:
            colour = _near(OTHER_RUBBLE[int(rng.integers(len(OTHER_RUBBLE)))], rng, 0.05)
            changed = dataclasses.replace(solid, colour=colour)
            if solid.hull is not None:
                reach = np.ptp(np.array(solid.hull.points_m), axis=0) * rng.uniform(0.4, 1.1, 3)
                sides = tuple(float(each) for each in np.maximum(reach, 0.05))
                changed = dataclasses.replace(changed, hull=None, box=d.Box((sides[0], sides[1], sides[2])))
        elif solid.label.startswith("debris"):
            colour = solid.colour
            if rng.random() < tinted:
                colour = _near(TINTED_RUBBLE[int(rng.integers(len(TINTED_RUBBLE)))], rng, 0.05)
            red, green, blue = (min(bright * each, 1.0) for each in colour)
            changed = dataclasses.replace(solid, colour=(red, green, blue))
        solids.append(changed)
    return dataclasses.replace(described, solids=tuple(solids))


def _near(colour: Colour, rng: Rng, spread: float) -> Colour:
    red, green, blue = (float(np.clip(each + rng.uniform(-spread, spread), 0.0, 1.0)) for each in colour)
    return red, green, blue


class Shot(NamedTuple):
    """Where a frame is taken from."""

    north_m: float
    east_m: float
    above_m: float
    """The ground below."""
    heading_rad: float
    tilt_rad: float
    """From straight down, forward."""
    roll_rad: float
    time_s: float


def shot(rng: Rng, drawn: Drawn, targets: list[tuple[float, float]]) -> Shot:
    """Mostly 10 to 30 m up and near straight down, now and then 5 to 60 m; three of four within reach of a target."""
    low, high = (10.0, 30.0) if rng.random() < 0.7 else (5.0, 60.0)
    above = math.exp(float(rng.uniform(math.log(low), math.log(high))))
    corners = np.array(drawn.description.area_m)
    if targets and rng.random() < 0.75:
        north, east = np.array(targets[int(rng.integers(len(targets)))]) + rng.uniform(-1.0, 1.0, 2) * above
    else:
        north, east = rng.uniform(corners.min(axis=0), corners.max(axis=0))
    tilt = float(np.clip(rng.normal(scale=0.17), -0.6, 0.6))
    return Shot(float(north), float(east), above, float(rng.uniform(-math.pi, math.pi)), tilt,
                float(np.clip(rng.normal(scale=0.06), -0.2, 0.2)), float(rng.uniform(1.0, 120.0)))  # fmt: skip
