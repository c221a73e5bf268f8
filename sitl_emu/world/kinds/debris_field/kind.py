"""What an earthquake left: collapsed houses, tilted slabs, walls that still stand, and rubble of all sizes between.

Every piece is a solid of its own, convex, which lidar sees and vehicles meet. Shares and sizes are ours; rubble's sizes
follow a power law, as those of broken rock do.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from sitl_emu.world import description as d
from sitl_emu.world.kind_options import Option, chosen
from sitl_emu.world.kinds import Generated
from sitl_emu.world.terrain import HeightMap, hills

Rng = np.random.Generator
OPTIONS = {
    "size_m": Option(120.0, 60.0, 300.0),
    "ruins": Option(7, 0, 40, True),
    "rubble": Option(260, 0, 1500, True),
    "persons": Option(6, 0, 100, True),
    "relief_m": Option(3.0, 0.0, 20.0),
}
SURROUNDINGS_M = 40.0
APART_M, TRIES = 19.0, 50
"""Between the middles of two ruins: the diagonal of a floor and a path. Where tries end, they lie as they fall."""
SMALLEST_M, LARGEST_M, EXPONENT = 0.18, 1.6, 1.5
"""Radii of rubble, and the exponent of how many are larger than one."""
PADS = {
    "home": d.Place(6.0, 6.0, 45.0),
    "home2": d.Place(-7.5, 6.0, 45.0),
    "home3": d.Place(6.0, -7.5, 45.0),
    "home4": d.Place(-7.5, -7.5, 45.0),
}
"""Where vehicles start: farther apart than the columns of air that they rise in (missions/companion/swarm)."""
GREYS = ((0.62, 0.60, 0.57), (0.55, 0.53, 0.50), (0.68, 0.65, 0.60), (0.50, 0.46, 0.42), (0.60, 0.42, 0.34))
GREEN = (0.24, 0.33, 0.15)
THICKETS = 9
CLEAR_M = 6.0
"""Between a thicket and the road, or where a vehicle starts."""
TOPS = ((0.85, 0.20, 0.12), (0.15, 0.32, 0.65), (0.90, 0.60, 0.10), (0.35, 0.50, 0.30))


def generate(seed: int, options: Mapping[str, Any]) -> Generated:
    """See kinds; the options are OPTIONS."""
    wanted = chosen("debris_field", OPTIONS, options)
    rng = np.random.default_rng((seed, 102))
    size = wanted["size_m"]
    reach = (-SURROUNDINGS_M, size + SURROUNDINGS_M)
    terrain = hills(rng, reach, reach, max(wanted["relief_m"], 0.05), (size, size))
    places = _apart(rng, size, int(wanted["ruins"]))
    solids: list[d.Solid] = []
    headings = [float(rng.uniform(0, 180)) for _ in places]
    for (n, e), heading in zip(places, headings, strict=True):
        _ruin(n, e, heading, terrain, rng, solids)
    _rubble(rng, size, int(wanted["rubble"]), places, solids)
    road = _way_through(rng, size, places)
    things = _things(rng, size, road, places, int(wanted["persons"]))
    return Generated(
        d.WorldDescription(
            name="debris_field",
            seed=seed,
            places={**PADS, "road": d.Place(4.0, road, 0.0)},
            area_m=((0.0, 0.0), (size, 0.0), (size, size), (0.0, size)),
            terrain=d.Terrain(
                file="terrain.npy", north0_m=terrain.north0_m, east0_m=terrain.east0_m, spacing_m=terrain.spacing_m
            ),
            ground=d.Ground(use="soil", land=_land(rng, size, road, places, headings)),
            solids=tuple(solids),
            things=tuple(things),
            cover=tuple(_thickets(rng, size, road)),
            light=d.Light(azimuth_deg=float(rng.uniform(90, 270)), elevation_deg=float(rng.uniform(30, 55))),
        ),
        terrain,
    )


def _place(rng: Rng, size: float, margin: float) -> tuple[float, float]:
    n, e = rng.uniform(margin, size - margin, 2)
    return float(n), float(e)


def _apart(rng: Rng, size: float, count: int) -> list[tuple[float, float]]:
    """Where houses stood: none in another, as long as there is room."""
    places: list[tuple[float, float]] = []
    for _ in range(count):
        for _ in range(TRIES):
            place = _place(rng, size, 14.0)
            if all(math.dist(place, other) > APART_M for other in places):
                break
        places.append(place)
    return places


def _way_through(rng: Rng, size: float, places: list[tuple[float, float]]) -> float:
    """Where a road to the north has the most room between ruins."""
    tried = rng.uniform(0.3, 0.7, 12) * size
    room = [min((abs(e - road) for _, e in places), default=0.0) for road in tried]
    return float(tried[int(np.argmax(room))])


def _blob(rng: Rng, north: float, east: float, radius: float) -> tuple[tuple[float, float], ...]:
    """A ragged outline."""
    angles = np.arange(24) * math.tau / 24
    reach = radius * (
        1.0 + 0.18 * np.cos(2 * angles + rng.uniform(0, 6)) + 0.12 * np.cos(3 * angles + rng.uniform(0, 6))
    )
    reach *= rng.uniform(0.9, 1.1, 24)
    return tuple(
        (north + float(r * math.cos(a)), east + float(r * math.sin(a))) for a, r in zip(angles, reach, strict=True)
    )


def _land(
    rng: Rng, size: float, road: float, places: list[tuple[float, float]], headings: list[float]
) -> tuple[d.LandUse, ...]:
    """Grass and soil, a road, dust around the ruins, and their floors."""
    far = size + SURROUNDINGS_M
    grass = [d.LandUse("grass", _blob(rng, *_place(rng, size, 0.0), float(rng.uniform(10, 30)))) for _ in range(7)]
    asphalt = ((-SURROUNDINGS_M, road - 3.2), (far, road - 3.2), (far, road + 3.2), (-SURROUNDINGS_M, road + 3.2))
    dust = [d.LandUse("gravel", _blob(rng, n, e, float(rng.uniform(9, 14)))) for n, e in places]
    floors = [d.LandUse("concrete", _turned(n, e, 6.5, 5.0, heading))
              for (n, e), heading in zip(places, headings, strict=True)]  # fmt: skip
    return (*grass, *dust, d.LandUse("asphalt", asphalt), *floors)


def _turned(north: float, east: float, long: float, wide: float, heading_deg: float) -> tuple[tuple[float, float], ...]:
    """A rectangle about a place, by its half sides."""
    s, c = math.sin(math.radians(heading_deg)), math.cos(math.radians(heading_deg))
    corners = ((-long, -wide), (long, -wide), (long, wide), (-long, wide))
    return tuple((north + c * a - s * b, east + s * a + c * b) for a, b in corners)


def _ruin(north: float, east: float, heading: float, terrain: HeightMap, rng: Rng, solids: list[d.Solid]) -> None:
    """Slabs that lean on one another, stumps of walls, and blocks among them."""
    number = len(solids)
    base = terrain.height_m(north, east)

    def add(kind: str, dn: float, de: float, up: float, label: str, size: tuple[float, float, float], pitch: float,
            roll: float, turn: float) -> None:  # fmt: skip
        n, e = north + dn, east + de
        # Heights are counted from the ground under the piece, the ruin's from its middle
        above = up + base - terrain.height_m(n, e)
        solids.append(
            d.Solid(
                f"{kind} {len(solids)}", n, e, (heading + turn) % 360.0, pitch, roll, above, label,
                GREYS[int(rng.integers(len(GREYS) - 1))], box=d.Box(size),
            )
        )  # fmt: skip

    for k in range(int(rng.integers(3, 6))):
        size = (float(rng.uniform(4, 8)), float(rng.uniform(3, 6)), 0.25)
        dn, de = (float(each) for each in rng.normal(scale=2.2, size=2))
        add("slab", dn, de, 0.4 + 0.45 * k, "debris slab", size,
            float(rng.normal(scale=16)), float(rng.normal(scale=14)), float(rng.normal(scale=20)))  # fmt: skip
    for side in range(int(rng.integers(2, 4))):
        angle = math.radians(heading) + side * math.pi / 2
        dn, de = 5.0 * math.cos(angle), 5.0 * math.sin(angle)
        long = float(rng.uniform(3.0, 7.5))
        high = float(rng.uniform(1.2, 5.5))
        add("wall", dn, de, -0.3, "debris wall", (0.35, long, high), float(rng.normal(scale=4)), 0.0, side * 90.0)
    for _ in range(int(rng.integers(6, 12))):
        radius = float(rng.uniform(0.35, 1.3))
        dn, de = (float(each) for each in rng.normal(scale=4.2, size=2))
        solids.append(_block(rng, f"block {len(solids)}", north + dn, east + de, radius, 0.35 * radius))
    beam = (float(rng.uniform(3.5, 6.0)), 0.3, 0.3)
    dn, de = (float(each) for each in rng.normal(scale=2.0, size=2))
    add("beam", dn, de, 1.2, "debris beam", beam, float(rng.uniform(-35, 35)), 10.0,
        float(rng.uniform(0, 180)))  # fmt: skip
    assert len(solids) > number


def _block(rng: Rng, name: str, north: float, east: float, radius: float, above: float) -> d.Solid:
    """An irregular convex piece."""
    count = int(rng.integers(9, 16))
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    points *= rng.uniform(0.55, 1.0, (count, 1)) * radius * rng.uniform(0.5, 1.15, 3)
    rounded = tuple((float(n), float(e), float(u)) for n, e, u in points.round(3))
    return d.Solid(
        name, north, east, float(rng.uniform(0, 360)), float(rng.uniform(-30, 30)), 0.0, above, "debris rubble",
        GREYS[int(rng.integers(len(GREYS)))], hull=d.Hull(rounded),
    )  # fmt: skip


def _rubble(rng: Rng, size: float, count: int, places: list[tuple[float, float]], solids: list[d.Solid]) -> None:
    """Pieces around the ruins, one in nine of them anywhere."""
    for k in range(count):
        share = float(rng.random())
        ratio = (SMALLEST_M / LARGEST_M) ** EXPONENT
        radius = SMALLEST_M * (1.0 - share * (1.0 - ratio)) ** (-1.0 / EXPONENT)
        if places and k % 9:
            n0, e0 = places[int(rng.integers(len(places)))]
            n, e = n0 + float(rng.normal(scale=6.5)), e0 + float(rng.normal(scale=6.5))
        else:
            n, e = _place(rng, size, 0.0)
        solids.append(_block(rng, f"rubble {k}", n, e, radius, 0.3 * radius))


def _thickets(rng: Rng, size: float, road: float) -> list[d.Cover]:
    """Trees that still stand, around the place, clear of the road and of where vehicles start."""
    made = list[d.Cover]()
    while len(made) < THICKETS:
        angle, reach = float(rng.uniform(0.0, math.tau)), float(rng.uniform(0.62, 0.76)) * size
        n, e = 0.5 * size + reach * math.cos(angle), 0.5 * size + reach * math.sin(angle)
        high, radius = float(rng.uniform(5.0, 10.0)), float(rng.uniform(6.0, 11.0))
        at_pads = any(math.hypot(n - pad.north_m, e - pad.east_m) <= radius + CLEAR_M for pad in PADS.values())
        if abs(e - road) > radius + CLEAR_M and not at_pads:
            made.append(d.Cover(f"trees {len(made)}", "canopy", _blob(rng, n, e, radius), high, 1.2, 0.7, colour=GREEN))
    return made


def _things(rng: Rng, size: float, road: float, places: list[tuple[float, float]], persons: int) -> list[d.Thing]:
    made = [
        d.Thing("truck", 0.35 * size, road + 1.4, 3.4, 3.0, heading_deg=4.0, name="truck", colour=(0.75, 0.32, 0.08)),
        d.Thing("car", 0.62 * size, road - 1.6, 2.15, 1.45, heading_deg=170.0, name="car", colour=(0.35, 0.38, 0.42)),
        d.Thing("stop_sign", 0.2 * size, road + 4.0, 0.3, 2.3, name="stop sign", heading_deg=180.0),
    ]
    for k in range(persons):
        n0, e0 = places[k % len(places)] if places and k % 2 else _place(rng, size, 8.0)
        n, e = n0 + float(rng.normal(scale=6.0)), e0 + float(rng.normal(scale=6.0))
        made.append(
            d.Thing(
                "person", n, e, 0.28, float(rng.uniform(1.58, 1.88)), heading_deg=float(rng.uniform(0, 360)),
                target=True, name=f"person {k}", colour=TOPS[k % len(TOPS)], seed=k,
            )
        )  # fmt: skip
    return made
