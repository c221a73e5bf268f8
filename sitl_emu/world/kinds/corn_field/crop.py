"""Where every plant and piece of litter of a corn field stands, as arrays sorted by place.

Rows of corn with gaps where a seed failed, a weed or a straw here and there, and what each object of the field changes:
weeds stand anywhere within their patch and take no heed of rows; disease, paleness and lushness befall the plants of
the rows; bare soil, water and residue leave few plants.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.kinds.corn_field.field import HEADLAND_M, PLANT_SPACING_M, SURROUNDINGS_M, CornField
from sitl_emu.world.kinds.corn_field.objects import FieldObject, inside
from sitl_emu.world.kinds.corn_field.sprites import SPRITES_PER_KIND

FloatArray = npt.NDArray[np.float64]
KINDS = tuple(SPRITES_PER_KIND)
PASS_ROWS = 8
"""Of a planter; ours."""
SURVIVAL = {"bare_soil": 0.06, "puddle": 0.22, "residue": 0.45, "weed": 0.75}
"""Share of the corn plants that stand within such an object."""


class Plants(NamedTuple):
    """Everything stamped on the ground, in the order it is stamped (litter, corn, weeds)."""

    north_m: FloatArray
    east_m: FloatArray
    kind: npt.NDArray[np.int8]
    """Index into KINDS."""
    variant: npt.NDArray[np.int16]
    """Sprite of that kind."""


def _pick(rng: np.random.Generator, kind: str, count: int) -> tuple[npt.NDArray[np.int8], npt.NDArray[np.int16]]:
    kinds = np.full(count, KINDS.index(kind), np.int8)
    return kinds, rng.integers(SPRITES_PER_KIND[kind], size=count).astype(np.int16)


def _scatter(rng: np.random.Generator, thing: FieldObject, per_m2: float) -> tuple[FloatArray, FloatArray]:
    """Points spread over an object's outline, at a density."""
    reach = 1.25 * thing.radius_m
    count = int(rng.poisson(per_m2 * (2.0 * reach) ** 2))
    north = thing.north_m + rng.uniform(-reach, reach, size=count)
    east = thing.east_m + rng.uniform(-reach, reach, size=count)
    within = inside(thing, north, east)
    return north[within], east[within]


def grow(field: CornField) -> Plants:
    """All plants and litter of a field; a function of the field alone."""
    rng = np.random.Generator(np.random.PCG64([field.seed, 0xC209]))
    parts: list[tuple[FloatArray, FloatArray, npt.NDArray[np.int8], npt.NDArray[np.int16]]] = []

    around = SURROUNDINGS_M - 4.0
    count = int(0.12 * (field.size_m[0] + 2 * around) * (field.size_m[1] + 2 * around))
    parts.append(
        (
            rng.uniform(-around, field.size_m[0] + around, size=count),
            rng.uniform(-around, field.size_m[1] + around, size=count),
            *_pick(rng, "litter", count),
        )
    )
    for thing in field.objects:
        own = np.random.Generator(np.random.PCG64([thing.seed, 1]))
        if thing.kind in ("residue", "disease"):
            # Dead leaves lie under sick plants too: straw colour alone says nothing.
            north, east = _scatter(own, thing, 20.0 if thing.kind == "residue" else 1.0)
            parts.append((north, east, *_pick(own, "residue" if thing.kind == "residue" else "litter", len(north))))

    parts.append(_rows(rng, field))

    count = int(0.008 * field.size_m[0] * field.size_m[1])
    for kind in ("weed_broad", "weed_grass"):
        parts.append(
            (
                rng.uniform(1.0, field.size_m[0] - 1.0, size=count),
                rng.uniform(1.0, field.size_m[1] - 1.0, size=count),
                *_pick(rng, kind, count),
            )
        )
    for thing in field.objects:
        if thing.kind == "weed":
            own = np.random.Generator(np.random.PCG64([thing.seed, 2]))
            share = own.uniform(0.2, 0.8)
            for kind, per_m2 in (("weed_broad", 34.0 * share), ("weed_grass", 34.0 * (1.0 - share))):
                north, east = _scatter(own, thing, per_m2)
                parts.append((north, east, *_pick(own, kind, len(north))))
    return Plants(
        np.concatenate([part[0] for part in parts]),
        np.concatenate([part[1] for part in parts]),
        np.concatenate([part[2] for part in parts]),
        np.concatenate([part[3] for part in parts]),
    )


def _between_the_ends(field: CornField, north_m: FloatArray) -> npt.NDArray[np.bool_]:
    """Which plants (rows, places) a planter sowed: at each pass it is let down and lifted a little late or early."""
    rng = np.random.Generator(np.random.PCG64([field.seed, 0xE2D5]))
    rows = len(north_m)
    passes = math.ceil(rows / PASS_ROWS)
    late = np.repeat(rng.uniform(0.0, 0.6, size=(2, passes)), PASS_ROWS, axis=1)[:, :rows]
    late = late + rng.uniform(0.0, 0.25, size=(2, rows))
    first, last = HEADLAND_M + late[0] - 0.1, field.size_m[0] - HEADLAND_M - late[1] + 0.1
    return np.asarray((north_m >= first[:, None]) & (north_m <= last[:, None]))


def _rows(
    rng: np.random.Generator, field: CornField
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int8], npt.NDArray[np.int16]]:
    """The corn itself."""
    rows = np.asarray(field.row_east_m)
    places = np.arange(HEADLAND_M, field.size_m[0] - HEADLAND_M, PLANT_SPACING_M)
    north = (places[None, :] + rng.normal(scale=0.025, size=(len(rows), len(places)))).ravel()
    # A planter wanders: slowly, and each row for itself.
    wander = np.cumsum(rng.normal(scale=0.006, size=(len(rows), len(places))), axis=1)
    wander -= wander.mean(axis=1, keepdims=True)
    east = (rows[:, None] + np.clip(wander, -0.08, 0.08) + rng.normal(scale=0.012, size=wander.shape)).ravel()
    kind, variant = _pick(rng, "corn", len(north))
    stands = rng.uniform(size=len(north)) > 0.05
    stands &= _between_the_ends(field, north.reshape(len(rows), -1)).ravel()
    for thing in field.objects:
        near = np.flatnonzero((abs(north - thing.north_m) < 1.5) & (abs(east - thing.east_m) < 1.5))
        within = near[inside(thing, north[near], east[near])]
        own = np.random.Generator(np.random.PCG64([thing.seed, 3]))
        if thing.kind in SURVIVAL:
            stands[within] &= own.uniform(size=len(within)) < SURVIVAL[thing.kind]
        elif thing.kind in KINDS:
            befallen = within[own.uniform(size=len(within)) < 0.95]
            kind[befallen], variant[befallen] = _pick(own, thing.kind, len(befallen))
            stands[befallen] = own.uniform(size=len(befallen)) > 0.04
    return north[stands], east[stands], kind[stands], variant[stands]
