"""A grass fire that runs towards a forest: burnt ground behind a front that moves with the wind, a track before it.

Flames, embers and smoke are those of `fires.py`. Burnt trunks stand in what has burnt, the forest is a canopy. Figures
are ours; the rate of spread is that of grass in a light wind, about a tenth of it.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from sitl_emu.world import description as d
from sitl_emu.world.kind_options import Option, chosen
from sitl_emu.world.kinds import Generated
from sitl_emu.world.terrain import hills

Rng = np.random.Generator
OPTIONS = {
    "size_m": Option(200.0, 100.0, 400.0),
    "flame_height_m": Option(1.8, 0.3, 10.0),
    "spread_m_s": Option(0.12, 0.0, 3.0),
    "wind_m_s": Option(4.0, 0.5, 15.0),
    "persons": Option(5, 0, 50, True),
    "relief_m": Option(9.0, 0.0, 40.0),
}
SURROUNDINGS_M = 40.0
BURNS_S = 45.0
SMOKE_M = 45.0
APART_M, PAD_M = 13.5, 2.0
"""Between start places, and what is free about each."""
YELLOW = (0.92, 0.74, 0.10)
"""What fire crews wear."""


def generate(seed: int, options: Mapping[str, Any]) -> Generated:
    """See kinds; the options are OPTIONS."""
    wanted = chosen("wildfire_perimeter", OPTIONS, options)
    rng = np.random.default_rng((seed, 103))
    size = wanted["size_m"]
    reach = (-SURROUNDINGS_M, size + SURROUNDINGS_M)
    terrain = hills(rng, reach, reach, max(wanted["relief_m"], 0.05), (size, size))
    blows = math.radians(float(rng.uniform(-18, 18)))
    front = 0.40 * size
    # The wind blows to the north, more or less; the front is a strip across the land
    edge = np.linspace(0.06 * size, 0.94 * size, 15)
    bow = 6.0 * np.sin(edge / size * math.pi) + rng.normal(scale=0.4, size=len(edge))
    ahead = [(front + float(b), float(e)) for e, b in zip(edge, bow, strict=True)]
    burning = _convex([(front - 5.0, ahead[0][1]), *ahead, (front - 5.0, ahead[-1][1])])
    burnt = [(-SURROUNDINGS_M, 0.02 * size), (front - 3.0, 0.05 * size), *[(n - 1.5, e) for n, e in ahead],
             (front - 3.0, 0.95 * size), (-SURROUNDINGS_M, 0.98 * size)]  # fmt: skip
    track = 0.62 * size
    things = _things(rng, size, track, front, int(wanted["persons"]))
    far = size + SURROUNDINGS_M
    forest = (
        (0.70 * size, -35.0),
        (far - 4, -35.0),
        (far - 4, far - 4),
        (0.68 * size, far - 4),
        (0.72 * size, 0.5 * size),
    )
    return Generated(
        d.WorldDescription(
            name="wildfire_perimeter",
            seed=seed,
            places={**_pads(track, size), "crew": d.Place(track, 0.5 * size, 180.0)},
            area_m=((0.0, 0.0), (size, 0.0), (size, size), (0.0, size)),
            terrain=d.Terrain(
                file="terrain.npy", north0_m=terrain.north0_m, east0_m=terrain.east0_m, spacing_m=terrain.spacing_m
            ),
            ground=d.Ground(
                use="grass",
                land=(
                    d.LandUse("forest_floor", forest),
                    d.LandUse("soil", _band(track, -35.0, far, 3.4, rng)),
                    d.LandUse("charred", tuple(burnt)),
                ),
            ),
            solids=tuple(_trunks(rng, size, front)),
            things=tuple(things),
            fires=(
                d.Fire(
                    "fire front", burning, wanted["flame_height_m"], wanted["spread_m_s"], BURNS_S,
                    smoke=d.Smoke(height_m=SMOKE_M, density_1_m=0.22, rise_m_s=2.5),
                ),
            ),
            cover=(
                d.Cover("forest", "canopy", forest, 13.0, base_m=3.0, density=0.8, colour=(0.20, 0.30, 0.14)),
                d.Cover("meadow", "grass", _band(0.53 * size, 0.1 * size, 0.9 * size, 0.05 * size, rng), 0.45,
                        density=0.7, colour=(0.42, 0.40, 0.20)),
            ),
            wind=d.Wind(
                wanted["wind_m_s"] * math.cos(blows), wanted["wind_m_s"] * math.sin(blows), 0.12 * wanted["wind_m_s"]
            ),
            light=d.Light(float(rng.uniform(200, 280)), float(rng.uniform(26, 42)), warmth=1.15),
        ),
        terrain,
    )  # fmt: skip


def _pads(track: float, size: float) -> dict[str, d.Place]:
    """Where vehicles start, on the track: farther apart than the columns of air that they rise in."""
    easts = {"home": 0.12 * size, "home2": 0.12 * size + APART_M}
    easts |= {f"home{number}": 0.12 * size - (number - 2) * APART_M for number in (3, 4)}
    return {name: d.Place(track, east, 90.0) for name, east in easts.items()}


def _convex(points: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    from sitl_emu.world.polygons import hull

    return hull(points)


def _band(north: float, west: float, east: float, half: float, rng: Rng) -> tuple[tuple[float, float], ...]:
    """A strip from west to east that winds a little."""
    at = np.linspace(west, east, 16)
    sway = np.cumsum(rng.normal(scale=0.5, size=16))
    one = [(north + half + float(s), float(e)) for s, e in zip(sway, at, strict=True)]
    other = [(north - half + float(s), float(e)) for s, e in zip(sway, at, strict=True)]
    return tuple(one + other[::-1])


def _trunks(rng: Rng, size: float, front: float) -> list[d.Solid]:
    """What is left of trees, in what has burnt."""
    made = []
    for k in range(round(0.22 * size)):
        north, east = float(rng.uniform(-10.0, front - 10.0)), float(rng.uniform(0.08, 0.92) * size)
        made.append(
            d.Solid(
                f"trunk {k}", north, east, float(rng.uniform(0, 360)), float(rng.normal(scale=5)), 0.0, -0.3, "trunk",
                (0.10, 0.09, 0.085),
                cylinder=d.Cylinder(float(rng.uniform(0.10, 0.24)), float(rng.uniform(1.5, 8.0))),
            )
        )  # fmt: skip
    return made


def _beside_track(rng: Rng, size: float, track: float, front: float) -> tuple[float, float]:
    return float(rng.uniform(front + 0.06 * size, track + 3.0)), float(rng.uniform(0.25, 0.75) * size)


def _things(rng: Rng, size: float, track: float, front: float, persons: int) -> list[d.Thing]:
    made = [
        d.Thing("truck", track, 0.46 * size, 3.4, 3.1, heading_deg=92.0, name="fire engine", colour=(0.72, 0.07, 0.06)),
        d.Thing("car", track - 0.5, 0.38 * size, 2.15, 1.5, heading_deg=85.0, name="car", colour=(0.85, 0.84, 0.80)),
        d.Thing("stop_sign", track + 4.6, 0.2 * size, 0.3, 2.3, heading_deg=90.0, name="stop sign"),
    ]
    pads = _pads(track, size).values()
    for k in range(persons):
        north, east = _beside_track(rng, size, track, front)
        while any(math.hypot(north - pad.north_m, east - pad.east_m) < PAD_M for pad in pads):
            north, east = _beside_track(rng, size, track, front)
        made.append(
            d.Thing(
                "person", north, east, 0.28, float(rng.uniform(1.62, 1.9)),
                heading_deg=180.0 + float(rng.normal(scale=40)),
                target=True, name=f"person {k}", colour=YELLOW, seed=k,
            )
        )  # fmt: skip
    return made
