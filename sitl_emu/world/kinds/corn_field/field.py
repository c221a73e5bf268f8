"""A corn field with targets and distractors, built from a seed: the agriculture mission's world.

One plain description from which physics (terrain), lidar, camera, ground truth, scoring and maps follow.

Frame: metres north and east of the **origin, the field's south-west corner**, heights up from the ground there. The
origin is the UAS's home. The field's outline is the rectangle 0..size_m[0] north, 0..size_m[1] east for every seed.
Corn rows run north-south, 0.75 m apart (30 inches, the usual spacing in Indiana); a headland of bare soil 3 m wide
lies between the outermost plants and the outline. The UGV starts on the headland in the south-east corner, facing
north-west over the field, and no target lies within 40 m of that place.
It does not model plants as obstacles: at the growth stages built here (V5 to V8, knee-high) a rover with the
clearance of a field robot drives over them.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sitl_emu.world.description import Light
from sitl_emu.world.kinds.corn_field.objects import DISTRACTOR_KINDS, GROWS_IN_ROWS, TARGET_KINDS, FieldObject
from sitl_emu.world.terrain import HeightMap, hills

ORIGIN_LAT_DEG, ORIGIN_LON_DEG, ORIGIN_ALT_AMSL_M = 40.47, -86.99, 215.0
"""Farm land by Purdue's agronomy centre, near West Lafayette, Indiana."""

DEFAULT_SIZE_M = (80.0, 80.0)
DEFAULT_TARGETS, DEFAULT_DISTRACTORS = 4, 18
ROW_SPACING_M = 0.75
PLANT_SPACING_M = 0.20
HEADLAND_M = 3.0
SURROUNDINGS_M = 24.0
"""Land drawn and heightened around the outline."""
UGV_CLEARANCE_M = 40.0
TARGET_SEPARATION_M = 6.0
MIN_SIDE_M = 60.0


class Wind(NamedTuple):
    """Mean wind, where it blows to, and the standard deviation of its gusts."""

    north_m_s: float
    east_m_s: float
    gust_m_s: float


class Place(NamedTuple):
    """A place to stand, heading in degrees from north over east."""

    north_m: float
    east_m: float
    heading_deg: float


@dataclass(frozen=True)
class CornField:
    """Everything there is to know about one field."""

    seed: int
    size_m: tuple[float, float]
    """Extent north and east."""
    origin_lat_deg: float
    origin_lon_deg: float
    origin_alt_amsl_m: float
    terrain: HeightMap
    objects: tuple[FieldObject, ...]
    growth_stage: int
    """Leaves with a collar: 5 for V5, to 8."""
    plant_height_m: float
    uas_home: Place
    ugv_start: Place
    wind: Wind
    light: Light

    @property
    def targets(self) -> tuple[FieldObject, ...]:
        """What the mission should find."""
        return tuple(thing for thing in self.objects if thing.is_target)

    @property
    def distractors(self) -> tuple[FieldObject, ...]:
        """What it should not take for a target."""
        return tuple(thing for thing in self.objects if not thing.is_target)

    @property
    def outline_m(self) -> tuple[tuple[float, float], ...]:
        """The field's four corners (north, east), from the origin to the east and round."""
        north, east = self.size_m
        return ((0.0, 0.0), (0.0, east), (north, east), (north, 0.0))

    @property
    def row_east_m(self) -> list[float]:
        """East of every corn row."""
        rows = int((self.size_m[1] - 2.0 * HEADLAND_M) / ROW_SPACING_M) + 1
        first = (self.size_m[1] - (rows - 1) * ROW_SPACING_M) / 2.0
        return [first + i * ROW_SPACING_M for i in range(rows)]


def build(
    seed: int,
    size_m: tuple[float, float] = DEFAULT_SIZE_M,
    targets: int = DEFAULT_TARGETS,
    distractors: int = DEFAULT_DISTRACTORS,
    growth_stage: int | None = None,
    relief_m: float | None = None,
) -> CornField:
    """The field of a seed.

    `size_m` is its extent north and east, each side at least 60 m, or no place would be 40 m from the UGV and clear of
    the edges. `growth_stage` (5..8) and `relief_m` (2..6) are the seed's choice unless given.
    Raises ValueError for what can't be built, naming the argument, and what is allowed.
    """
    _check(size_m, targets, distractors, growth_stage, relief_m)
    rng = np.random.Generator(np.random.PCG64([seed, 0xC042]))
    stage = growth_stage if growth_stage is not None else int(rng.integers(5, 9))
    relief = relief_m if relief_m is not None else float(rng.uniform(2.2, 3.2))
    around = SURROUNDINGS_M
    terrain = hills(rng, (-around, size_m[0] + around), (-around, size_m[1] + around), relief, size_m)
    wind_to, wind_speed = rng.uniform(0.0, math.tau), rng.uniform(1.0, 4.0)
    ugv_start = Place(HEADLAND_M / 2.0, size_m[1] - HEADLAND_M / 2.0, 315.0)
    field = CornField(
        seed=seed,
        size_m=size_m,
        origin_lat_deg=ORIGIN_LAT_DEG,
        origin_lon_deg=ORIGIN_LON_DEG,
        origin_alt_amsl_m=ORIGIN_ALT_AMSL_M,
        terrain=terrain,
        objects=(),
        growth_stage=stage,
        plant_height_m=(0.32, 0.42, 0.52, 0.62)[stage - 5],
        uas_home=Place(0.0, 0.0, 0.0),
        ugv_start=ugv_start,
        wind=Wind(wind_speed * math.cos(wind_to), wind_speed * math.sin(wind_to), float(rng.uniform(0.2, 0.8))),
        light=Light(
            azimuth_deg=float(rng.uniform(0.0, 360.0)),
            elevation_deg=float(rng.uniform(40.0, 65.0)),
            gain=float(rng.uniform(1.05, 1.35)),
            warmth=float(rng.uniform(0.95, 1.08)),
        ),
    )
    return CornField(**{**field.__dict__, "objects": _place_objects(rng, field, targets, distractors)})


def _check(
    size_m: tuple[float, float], targets: int, distractors: int, growth_stage: int | None, relief_m: float | None
) -> None:
    if min(size_m) < MIN_SIDE_M or max(size_m) > 400.0:
        raise ValueError(f"size_m: {size_m} m; each side must be {MIN_SIDE_M:.0f} to 400 m")
    if not 1 <= targets <= 40:
        raise ValueError(f"targets: {targets}; must be 1 to 40")
    if not 0 <= distractors <= 200:
        raise ValueError(f"distractors: {distractors}; must be 0 to 200")
    if growth_stage is not None and not 5 <= growth_stage <= 8:
        raise ValueError(f"growth_stage: {growth_stage}; must be 5 to 8")
    if relief_m is not None and not 2.0 <= relief_m <= 6.0:
        raise ValueError(f"relief_m: {relief_m} m; must be 2 to 6 m")


def _place_objects(
    rng: np.random.Generator, field: CornField, targets: int, distractors: int
) -> tuple[FieldObject, ...]:
    """Targets first, then distractors, each clear of the others; ValueError where the field is too small for them."""
    # One of each kind, then by chance: a mission should meet both kinds, and every trap.
    kinds = [TARGET_KINDS[i % 2] if i < 2 else str(rng.choice(TARGET_KINDS)) for i in range(targets)]
    kinds += [
        DISTRACTOR_KINDS[i % len(DISTRACTOR_KINDS)]
        if i < 2 * len(DISTRACTOR_KINDS)
        else str(rng.choice(DISTRACTOR_KINDS))
        for i in range(distractors)
    ]
    rows = np.asarray(field.row_east_m)
    placed: list[FieldObject] = []
    for kind in kinds:
        is_target = kind in TARGET_KINDS
        for _ in range(2000):
            thing = _candidate(rng, field, kind, rows)
            if _is_free(thing, placed, is_target, field):
                placed.append(thing)
                break
        else:
            raise ValueError(
                f"targets, distractors: no room for {targets} and {distractors} of them"
                f" on {field.size_m[0]:g} x {field.size_m[1]:g} m; ask for fewer or a larger size_m"
            )
    return tuple(placed)


def _candidate(rng: np.random.Generator, field: CornField, kind: str, rows: np.ndarray) -> FieldObject:
    radius = float(rng.uniform(0.40 if kind in GROWS_IN_ROWS else 0.36, 0.95))
    margin = HEADLAND_M + 2.0
    north = float(rng.uniform(margin, field.size_m[0] - margin))
    east = float(rng.uniform(margin, field.size_m[1] - margin))
    if kind in GROWS_IN_ROWS:
        # On a row: a narrow patch between two rows would hold no plant at all.
        east = float(rows[np.abs(rows - east).argmin()] + rng.uniform(-0.08, 0.08))
    amplitudes, phases = rng.uniform(0.0, (0.10, 0.08, 0.05)), rng.uniform(0.0, math.tau, size=3)
    harmonics = tuple((float(a), float(p)) for a, p in zip(amplitudes, phases, strict=True))
    return FieldObject(kind, north, east, radius, harmonics, int(rng.integers(1 << 31)))


def _is_free(thing: FieldObject, placed: list[FieldObject], is_target: bool, field: CornField) -> bool:
    start = field.ugv_start
    if is_target and math.hypot(thing.north_m - start.north_m, thing.east_m - start.east_m) < UGV_CLEARANCE_M + 1.0:
        return False
    for other in placed:
        gap = math.hypot(thing.north_m - other.north_m, thing.east_m - other.east_m)
        both_targets = is_target and other.is_target
        if gap < (TARGET_SEPARATION_M if both_targets else 1.25 * (thing.radius_m + other.radius_m) + 1.5):
            return False
    return True
