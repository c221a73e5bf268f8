"""How often a delivery to the same place, and to the same region, is tried; all numbers ours."""

import math
from collections.abc import Sequence

import numpy as np

from sitl_emu.missions.disaster.places import Place
from sitl_emu.missions.disaster.regions import Region, RegionMap

TRIES, REGION_TRIES = 2, 4
"""A flood has more than one shore."""
LEAVES = 3
"""So often a line is left in vain: what else is found waits until all lines are flown. With a receiver that wanders by
metres one flight left its lines 16 times, and had seen all after 640 s (debris, seed 1, at 394a9151); ours."""
SAME_EDGE_M = 6.0
"""A region whose edge lies so near to where it was when it was tried is that region: cells come and go."""


def is_left_at(tried: Sequence[Place], place: Place) -> bool:
    """Whether a place was not tried too often."""
    near = [one for one in tried if one.label == place.label and math.dist(one.edge_m, place.edge_m) <= SAME_EDGE_M]
    return len(near) < TRIES


def is_left(tried: Sequence[Place], regions: RegionMap, region: Region) -> bool:
    """Whether a region was not tried too often."""
    return sum(is_of(one, regions, region, SAME_EDGE_M) for one in tried) < REGION_TRIES


def is_of(place: Place, regions: RegionMap, region: Region, within_m: float) -> bool:
    """Whether a place's edge is a region's."""
    return region.label == place.label and away_m(place, regions, region) <= within_m


def away_m(place: Place, regions: RegionMap, region: Region) -> float:
    """How far a place's edge is from the nearest of a region's cells."""
    north, east = regions.north_m[region.cells], regions.east_m[region.cells]
    return float(np.hypot(north - place.edge_m[0], east - place.edge_m[1]).min())
