"""True areas of a world, as the mission counts them: what is there to be found, and where its edge lies, at a time.

Water is what its shores enclose; ruins are the ground under their slabs, walls and beams; of a fire it is what the
front has reached and what has not burnt out, with `EMBERS_S` that it glows. Parts nearer to each other than `GAP_M`
are one target, and what is smaller than `LEAST_M2` is none: as the mission's own regions (`regions.py`). And how high
the ground and the water are, over which a map was made and a scan flown.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Geometry, Polygon
from shapely.affinity import translate

from sitl_emu.missions.disaster.regions import GAP_M, LEAST_M2
from sitl_emu.missions.scoring import TrueArea

WATER, DEBRIS, FIRE = "water_body", "debris_field", "fire_region"
RUINS = ("debris slab", "debris wall", "debris beam")
"""Labels of solids that make a debris field, as the detector's data have it (tools/detector/disaster.py)."""
Floats = npt.NDArray[np.float64]
GroundAt = Callable[[float, float], float]
"""The ground's height at (north, east)."""
EMBERS_S = 10.0
"""sitl_emu/world/render/burning.py."""


class TrueTarget(NamedTuple):
    """One area that is there to be found."""

    label: str
    shape: Geometry
    """Metres, (north, east)."""


def targets(areas: Sequence[TrueArea], time_s: float) -> list[TrueTarget]:
    """All of a world, at a time."""
    found = []
    for label in (WATER, DEBRIS, FIRE):
        shapes = [shape for area in areas if (shape := _shape(area, label, time_s)) is not None]
        found += [TrueTarget(label, one) for one in sorted(joined(shapes), key=lambda one: one.bounds)]
    return found


def solids(areas: Sequence[TrueArea]) -> Geometry:
    """The ground under all that stands."""
    return shapely.union_all([Polygon(area.outline_m) for area in areas if area.kind == "solid" and _is_area(area)])


def surface_m(ground_m: GroundAt, areas: Sequence[TrueArea], north_m: Floats, east_m: Floats) -> Floats:
    """Heights (n,) over the world's origin at places (n,): the ground's, or the surface's of water that stands on it.

    That is what a lidar meets, and a camera sees of a flood, in which a Secchi disc is gone at 0.18 m
    (`urban_flood.kind`); what may not be flown through; and what a digital elevation model has (H. K. Heidemann, Lidar
    base specification, USGS Techniques and Methods 11-B4, 2018: hydro-flattening).
    """
    heights_m = np.array([ground_m(n, e) for n, e in zip(north_m.tolist(), east_m.tolist(), strict=True)])
    for area in areas:
        if area.level_m is not None:
            wet = shapely.contains_xy(Polygon(area.outline_m, area.islands_m), north_m, east_m)
            heights_m = np.where(wet, np.maximum(heights_m, area.level_m), heights_m)
    return heights_m


def joined(shapes: Sequence[Geometry]) -> list[Geometry]:
    """Shapes nearer to each other than GAP_M as one; what is too small is left out."""
    whole = shapely.union_all(list(shapes))
    grown = shapely.get_parts(whole.buffer(GAP_M / 2.0))
    return [part for one in grown if (part := whole.intersection(one)).area >= LEAST_M2]


def _shape(area: TrueArea, label: str, time_s: float) -> Geometry | None:
    """What of an area counts for a label; None: nothing."""
    if not _is_area(area):
        return None
    if label == WATER and area.kind == "water":
        return Polygon(area.outline_m, area.islands_m).buffer(0.0)
    if label == DEBRIS and area.kind == "solid" and area.label.startswith(RUINS):
        return Polygon(area.outline_m)
    if label == FIRE and area.kind == "fire":
        burnt_s = time_s - area.burns_s - EMBERS_S
        out = _swept(area, burnt_s) if area.burns_s and burnt_s > 0.0 else Polygon()
        return _swept(area, time_s).difference(out)
    return None


def _is_area(area: TrueArea) -> bool:
    return len(area.outline_m) >= 3


def _swept(area: TrueArea, time_s: float) -> Geometry:
    """What a front has reached: its outline, swept along its way."""
    north, east = area.front_m_s
    begun = Polygon(area.outline_m)
    return begun.union(translate(begun, time_s * north, time_s * east)).convex_hull if north or east else begun
