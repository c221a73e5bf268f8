"""A small town under water: streets, houses with flat and gabled roofs, brown water pooled in the low part.

North and west lie high, south and east low; houses stand along a grid of streets. Cars stand where they were left,
persons wait on roofs, wade and float. Sizes and shares are ours.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np

from sitl_emu.world import description as d
from sitl_emu.world.kind_options import Option, chosen
from sitl_emu.world.kinds import Generated
from sitl_emu.world.terrain import HeightMap

Rng = np.random.Generator
Rectangle = tuple[float, float, float, float]
"""South, west, north, east."""

OPTIONS = {
    "size_m": Option(160.0, 100.0, 400.0),
    "flood_m": Option(0.9, 0.0, 3.0),
    "persons": Option(14, 0, 200, True),
    "cars": Option(24, 0, 300, True),
    "trees": Option(20, 0, 200, True),
}
"""Side of the square; how deep the water stands in the lowest street, about; how many there are."""
SURROUNDINGS_M, SPACING_M = 40.0, 0.5
MURK_1_M = 9.4
"""Of flood water of 100 FNU, which carries soil: a Secchi disc is gone at 11.1 T^-0.637 feet, 0.18 m (USGS, Willamette
at Portland, or.water.usgs.gov/will_morrison/secchi_depth_model.html), and K = 1.7 over that depth (Poole and Atkins,
1929)."""
BANK_M = 2.0
"""How far the land around the town rises above the water, which so stays in the town."""
BELT_M = (16.0, 34.0)
"""Where woods stand around the town: so far outside."""
LAMPS_M = 27.0
"""From street lamp to street lamp."""
BLOCK_M, STREET_M, PAVEMENT_M = 46.0, 8.0, 2.2
YARD_M = 35.0
"""From its south to its north a block that has a yard, between two rows of houses, is longer; a shorter one, where the
town ends, has one row."""
PADS, PADS_APART_M, PAD_M = 4, 13.5, 2.0
"""Start places; farther apart than the columns of air that vehicles rise in; what is free about each."""
FALL_M = 2.2
"""How much lower the south-east corner lies than the north-west."""
SUNK_M = 1.5
"""Depth of a house's foot below the ground at its middle: walls reach down on a slope."""
WALLS = ((0.78, 0.71, 0.58), (0.62, 0.38, 0.30), (0.70, 0.72, 0.68), (0.83, 0.79, 0.72), (0.66, 0.58, 0.47),
         (0.58, 0.62, 0.60), (0.74, 0.60, 0.48))  # fmt: skip
ROOFS = ((0.56, 0.33, 0.25), (0.46, 0.30, 0.25), (0.35, 0.33, 0.33), (0.52, 0.37, 0.29))
CARS = ((0.55, 0.07, 0.07), (0.10, 0.18, 0.42), (0.80, 0.80, 0.80), (0.10, 0.10, 0.11), (0.42, 0.44, 0.46),
        (0.16, 0.30, 0.22), (0.72, 0.62, 0.16))  # fmt: skip
GREEN, GREY = (0.24, 0.33, 0.15), (0.52, 0.53, 0.54)
TOPS = ((0.80, 0.16, 0.14), (0.85, 0.45, 0.10), (0.15, 0.30, 0.62), (0.88, 0.84, 0.30), (0.85, 0.85, 0.85))


def generate(seed: int, options: Mapping[str, Any]) -> Generated:
    """See kinds; the options are OPTIONS."""
    wanted = chosen("urban_flood", OPTIONS, options)
    rng = np.random.default_rng((seed, 101))
    size = wanted["size_m"]
    terrain = _terrain(rng, size, wanted["flood_m"] + BANK_M)
    blocks = _blocks(size)
    houses: list[d.Solid] = []
    spots: list[tuple[float, float, float]] = []
    for block in blocks:
        _build(block, rng, houses, spots)
    level = terrain.height_m(8.0, size - 8.0) + wanted["flood_m"]
    things = [
        *_cars(rng, size, int(wanted["cars"])),
        *_persons(rng, size, terrain, spots, level, int(wanted["persons"])),
    ]
    green = np.random.default_rng((seed, 111))
    things += _trees(green, blocks, int(wanted["trees"]))
    houses += _lamps(size)
    crossing = _lines(size)[len(_lines(size)) // 2]
    corner = STREET_M + BLOCK_M + STREET_M / 2 - STREET_M
    things.append(d.Thing("stop_sign", corner - 6.0, corner - 5.4, 0.3, 2.3, name="stop sign", colour=(0.7, 0.1, 0.1)))
    return Generated(
        d.WorldDescription(
            name="urban_flood",
            seed=seed,
            origin=d.Origin(),
            places={**_pads(size, things), "street": d.Place(crossing, 0.3 * size, 90.0)},
            area_m=((0.0, 0.0), (size, 0.0), (size, size), (0.0, size)),
            terrain=d.Terrain(
                file="terrain.npy", north0_m=-SURROUNDINGS_M, east0_m=-SURROUNDINGS_M, spacing_m=SPACING_M
            ),
            ground=d.Ground(use="grass", land=_land(size, blocks)),
            solids=tuple(houses),
            things=tuple(things),
            water=(
                d.Water(
                    "flood", _around(size, SURROUNDINGS_M - SPACING_M), level,
                    colour=(0.40, 0.33, 0.23), murk_1_m=MURK_1_M,
                ),
            ),
            cover=tuple(_woods(size)),
            light=d.Light(azimuth_deg=float(rng.uniform(110, 250)), elevation_deg=float(rng.uniform(32, 55))),
        ),
        terrain,
    )  # fmt: skip


def _pads(size: float, things: Sequence[d.Thing]) -> dict[str, d.Place]:
    """Where vehicles start, along the westernmost street, no car near: home, out of town, and southwards."""
    east = STREET_M / 2

    def clear(north: float) -> float:
        while any(math.dist((north, east), (one.north_m, one.east_m)) < one.radius_m + PAD_M for one in things):
            north -= 0.5
        return north

    norths = [clear(size - 12.0), size + 2.0]
    while len(norths) < PADS:
        norths.append(clear(min(norths) - PADS_APART_M))
    names = ["home", *(f"home{number}" for number in range(2, PADS + 1))]
    return {name: d.Place(north, east, 135.0) for name, north in zip(names, norths, strict=True)}


def _terrain(rng: Rng, size: float, bank_m: float) -> HeightMap:
    """A gentle fall to the south-east, waves of a few decimetres, and a bank around the town."""
    count = round((size + 2 * SURROUNDINGS_M) / SPACING_M) + 1
    place = -SURROUNDINGS_M + SPACING_M * np.arange(count)
    north, east = np.meshgrid(place, place, indexing="ij")
    fall = FALL_M * (np.clip(north / size, -0.2, 1.2) - np.clip(east / size, -0.2, 1.2)) * 0.5
    coarse = rng.normal(size=(9, 9)).astype(np.float32)
    waves = cv2.resize(coarse, (count, count), interpolation=cv2.INTER_CUBIC)
    heights = fall + 0.28 * cv2.GaussianBlur(waves, (0, 0), 8.0)
    outside = np.max((-north, north - size, -east, east - size), axis=0)
    share = np.clip(outside / BELT_M[1], 0.0, 1.0)
    heights += bank_m * share * share * (3.0 - 2.0 * share)
    heights -= heights[round((size + SURROUNDINGS_M) / SPACING_M), round(SURROUNDINGS_M / SPACING_M)]
    return HeightMap(heights.astype(np.float64), -SURROUNDINGS_M, -SURROUNDINGS_M, SPACING_M)


def _lines(size: float) -> list[float]:
    """Middles of the streets."""
    pitch = BLOCK_M + STREET_M
    return [STREET_M / 2 + k * pitch for k in range(int((size - STREET_M) / pitch) + 1)]


def _blocks(size: float) -> list[Rectangle]:
    lines = [*_lines(size), size + STREET_M / 2]
    starts = [line + STREET_M / 2 for line in lines[:-1]]
    ends = [min(line - STREET_M / 2, size) for line in lines[1:]]
    return [
        (south, west, north, east)
        for south, north in zip(starts, ends, strict=True)
        for west, east in zip(starts, ends, strict=True)
        if north - south > 18.0 and east - west > 18.0
    ]


def _has_yard(block: Rectangle) -> bool:
    return block[2] - block[0] > YARD_M


def _rectangle(south: float, west: float, north: float, east: float) -> tuple[tuple[float, float], ...]:
    return (south, west), (north, west), (north, east), (south, east)


def _land(size: float, blocks: list[Rectangle]) -> tuple[d.LandUse, ...]:
    """Streets, pavements around the blocks, yards, and lines on the streets."""
    low, high = -SURROUNDINGS_M, size + SURROUNDINGS_M
    land = []
    for line in _lines(size):
        half = STREET_M / 2
        land.append(d.LandUse("asphalt", _rectangle(line - half, low, line + half, high)))
        land.append(d.LandUse("asphalt", _rectangle(low, line - half, high, line + half)))
    for block in blocks:
        south, west, north, east = block
        land.append(d.LandUse("concrete", _rectangle(south, west, north, east)))
        inset = PAVEMENT_M
        land.append(d.LandUse("grass", _rectangle(south + inset, west + inset, north - inset, east - inset)))
        if _has_yard(block):
            land.append(d.LandUse("gravel", _rectangle(south + 16, west + 14, north - 16, east - 14)))
    for line in _lines(size):
        for start in np.arange(low + 4.0, high - 4.0, 7.0):
            if all(abs(start + 1.5 - other) > STREET_M for other in _lines(size)):
                land.append(
                    d.LandUse("concrete", _rectangle(line - 0.08, float(start), line + 0.08, float(start) + 3.0))
                )
                land.append(
                    d.LandUse("concrete", _rectangle(float(start), line - 0.08, float(start) + 3.0, line + 0.08))
                )
    return tuple(land)


def _around(size: float, reach: float) -> tuple[tuple[float, float], ...]:
    return _rectangle(-reach, -reach, size + reach, size + reach)


def _woods(size: float) -> list[d.Cover]:
    """On the bank, left open where streets leave the town."""
    near, far = BELT_M
    gaps = [*_lines(size), size + far + STREET_M]
    made = []
    start = -far
    for number, line in enumerate(gaps):
        end = line - STREET_M
        if end - start > 12.0:
            for side, (low, high) in (("south", (-far, -near)), ("north", (size + near, size + far))):
                strip = _rectangle(low, start, high, end)
                made.append(d.Cover(f"wood {side} {number}", "canopy", strip, 9.0, 2.0, 0.75, colour=GREEN))
            if start > 0.0 and end < size:
                for side, (low, high) in (("west", (-far, -near)), ("east", (size + near, size + far))):
                    strip = _rectangle(start, low, end, high)
                    made.append(d.Cover(f"wood {side} {number}", "canopy", strip, 9.0, 2.0, 0.75, colour=GREEN))
        start = line + STREET_M
    return made


def _trees(rng: Rng, blocks: list[Rectangle], count: int) -> list[d.Thing]:
    """In the yards, one block after another."""
    made = []
    yards = [block for block in blocks if _has_yard(block)]
    for k in range(count):
        south, west, north, east = yards[k % len(yards)]
        n, e = rng.uniform((south + 17.5, west + 4.0), (north - 17.5, east - 4.0))
        high = float(rng.uniform(5.0, 9.0))
        made.append(d.Thing("tree", float(n), float(e), 0.3 * high, high, name=f"tree {k}", colour=GREEN, seed=k))
    return made


def _lamps(size: float) -> list[d.Solid]:
    """Posts along the kerbs of the streets that run east, with an arm over the street."""
    made = list[d.Solid]()
    for line in _lines(size):
        for k, east in enumerate(np.arange(14.0, size - 4.0, LAMPS_M)):
            if any(abs(east - other) < STREET_M for other in _lines(size)):
                continue
            side = 1.0 if k % 2 else -1.0
            kerb = line + side * (STREET_M / 2 + 0.5)
            name = f"lamp {len(made) // 2}"
            made.append(d.Solid(f"{name} post", kerb, float(east), above_ground_m=-0.2, label="pole", colour=GREY,
                                cylinder=d.Cylinder(0.07, 6.2)))  # fmt: skip
            made.append(d.Solid(f"{name} head", kerb - 0.7 * side, float(east), above_ground_m=5.9, label="pole",
                                colour=GREY, box=d.Box((1.5, 0.24, 0.10))))  # fmt: skip
    return made


def _build(block: Rectangle, rng: Rng, houses: list[d.Solid], spots: list[tuple[float, float, float]]) -> None:
    """Houses along the south and the north side of a block; places on flat roofs into `spots`."""
    south, west, north, east = block
    for side in (0, 1) if _has_yard(block) else (0,):
        at = west + PAVEMENT_M + 0.6
        while at < east - 10.0:
            wide = float(rng.uniform(10.0, 17.0))
            wide = min(wide, east - PAVEMENT_M - 0.6 - at)
            deep = float(rng.uniform(9.5, 13.0))
            if wide < 8.0:
                break
            middle = south + PAVEMENT_M + 0.6 + deep / 2 if side == 0 else north - PAVEMENT_M - 0.6 - deep / 2
            _house(middle, at + wide / 2, deep, wide, rng, houses, spots)
            at += wide + (0.0 if rng.random() < 0.55 else float(rng.uniform(2.5, 6.0)))


def _house(
    north: float, east: float, deep: float, wide: float, rng: Rng, houses: list[d.Solid],
    spots: list[tuple[float, float, float]],
) -> None:  # fmt: skip
    """Walls, and a gabled roof or a parapet with something on top."""
    number = len(houses)
    storeys = int(rng.choice([2, 3, 3, 4, 5]))
    up = 3.0 * storeys + 0.4
    wall = WALLS[int(rng.integers(len(WALLS)))]
    houses.append(d.Solid(f"house {number}", north, east, above_ground_m=-SUNK_M, colour=wall,
                          box=d.Box((deep, wide, up + SUNK_M))))  # fmt: skip
    if storeys <= 3 and rng.random() < 0.62:
        n, e, ridge = deep / 2 + 0.45, wide / 2 + 0.35, 0.38 * deep
        points = ((-n, -e, 0.0), (-n, e, 0.0), (n, e, 0.0), (n, -e, 0.0), (0.0, -e, ridge), (0.0, e, ridge))
        tiles = ROOFS[int(rng.integers(len(ROOFS)))]
        houses.append(d.Solid(f"roof {number}", north, east, above_ground_m=up, label="roof", colour=tiles,
                              hull=d.Hull(points)))  # fmt: skip
        houses.append(d.Solid(f"chimney {number}", north + 0.25 * deep, east + 0.2 * wide, above_ground_m=up + 0.5,
                              label="brick chimney", colour=(0.50, 0.30, 0.24), box=d.Box((0.7, 0.7, ridge)))
                      )  # fmt: skip
        return
    grey = (0.60, 0.59, 0.57)
    for name, dn, de, size in (
        ("south", -deep / 2 + 0.15, 0.0, (0.3, wide, 0.7)),
        ("north", deep / 2 - 0.15, 0.0, (0.3, wide, 0.7)),
        ("west", 0.0, -wide / 2 + 0.15, (deep, 0.3, 0.7)),
        ("east", 0.0, wide / 2 - 0.15, (deep, 0.3, 0.7)),
    ):
        houses.append(d.Solid(f"parapet {number} {name}", north + dn, east + de, above_ground_m=up, label="parapet",
                              colour=grey, box=d.Box(size)))  # fmt: skip
    n, e = float(rng.uniform(-0.2, 0.2)) * deep, float(rng.uniform(-0.3, -0.12)) * wide
    houses.append(d.Solid(f"stairs {number}", north + n, east + e, above_ground_m=up, label="concrete", colour=grey,
                          box=d.Box((2.4, 2.2, 2.3))))  # fmt: skip
    houses.append(d.Solid(f"unit {number}", north + 0.2 * deep, east + 0.22 * wide, above_ground_m=up, label="tank",
                          colour=(0.66, 0.67, 0.68), box=d.Box((1.6, 1.1, 0.9))))  # fmt: skip
    spots.append((north - 0.22 * deep, east + 0.12 * wide, up))


def _on_streets(rng: Rng, size: float) -> tuple[float, float, float]:
    """North, east and heading (deg) of a place in a lane."""
    lines = _lines(size)
    line = lines[int(rng.integers(len(lines)))]
    along = float(rng.uniform(4.0, size - 4.0))
    lane = float(rng.choice([-1, 1])) * 2.2
    if rng.random() < 0.5:
        return line + lane, along, 90.0 if lane < 0 else -90.0
    return along, line + lane, 0.0 if lane > 0 else 180.0


def _cars(rng: Rng, size: float, count: int) -> list[d.Thing]:
    cars: list[d.Thing] = []
    tries = 0
    while len(cars) < count and tries < 60 * count:
        tries += 1
        north, east, heading = _on_streets(rng, size)
        if any(math.hypot(north - car.north_m, east - car.east_m) < 6.5 for car in cars):
            continue
        is_truck = len(cars) % 9 == 4
        cars.append(
            d.Thing(
                "truck" if is_truck else "car", north, east, 3.4 if is_truck else 2.15, 3.1 if is_truck else 1.45,
                heading_deg=heading + float(rng.normal(scale=4.0)), name=f"car {len(cars)}",
                colour=CARS[int(rng.integers(len(CARS)))], seed=len(cars),
            )
        )  # fmt: skip
    return cars


def _persons(
    rng: Rng, size: float, terrain: HeightMap, spots: list[tuple[float, float, float]], level: float, count: int
) -> list[d.Thing]:
    """A third on roofs, the others in the streets; in deep water only head and shoulders are to be seen."""
    made: list[d.Thing] = []
    roofs = [spots[int(k)] for k in rng.permutation(len(spots))[: count // 3]]
    for number in range(count):
        height = float(rng.uniform(1.58, 1.88))
        if number < len(roofs):
            (north, east, above), label = roofs[number], "person"
        else:
            north, east, _ = _on_streets(rng, size)
            depth = level - terrain.height_m(north, east)
            above = max(depth - (height - 0.45), 0.0)
        label = "person"
        made.append(
            d.Thing(
                label, north, east, 0.28, height, heading_deg=float(rng.uniform(0, 360)), above_ground_m=above,
                target=True, name=f"person {number}", colour=TOPS[int(rng.integers(len(TOPS)))], seed=number,
            )
        )  # fmt: skip
    return made
