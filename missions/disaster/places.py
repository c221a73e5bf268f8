"""Where the parcel of an area goes: at its edge, on plain ground that is of no area.

A region of water, debris or fire is no place for a parcel; whoever needs it stands at its edge. **The place** lies on
ground that

- was looked at in `LOOKS` frames or more, and told by so many of them to be none that it is surely of no area
  (`SURELY`, `DOUBT`, `LOW_DOUBT`), water, debris or fire, with `KEEP_OFF_M` around it;
- was seen from nearly above (`ASLANT`): farther aslant a wall is taken for the ground behind it; and from so different
  places (`TURNED_DEG`) that a roof's corners would be known by now;
- is plain within `PLAIN_M`: no person, car, wall or kerb within that (`sight.py`);
- has nothing within `PLAIN_M` that is mapped as standing (`relief.py`), as a wall has no edges, and shade none; and
  nothing within `BESIDE_M` that reaches up to where the vehicle lets go;
- is nearer to ground that is mapped than to such a thing: of a plain roof nothing is mapped but its edges;
- is part of `LAND_M2` or more of ground that is surely of no area and no roof: what looks dry in the midst of a flood
  is mostly water in a house's shade;
- lies within `WITHIN_M` of the region, so that the parcel, which slides and tumbles, comes to rest within 5 m of it.

Of such ground the place nearest to where the vehicle is wins, and of those alike the one that is `BEST_M` off the
region, and the plainest.
**The located point** of an area is its edge there: the cell of it that is nearest to the place. A region's cells are
those that frames are sure of; its edge is where half of what they show is of it (`HALF`).

`sigma_m` says how well that is located: the cell's size, the rays' angles, the ground's height times the angle from
straight down at which it was seen best, and the receiver's error.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.geolocation import RAY_SIGMA_RAD, Covariance
from sitl_emu.missions.companion.terrain.survey import LEAST_DEG
from sitl_emu.missions.disaster.aborts import DELIVERED_WITHIN_M
from sitl_emu.missions.disaster.detectors import SPREADING
from sitl_emu.missions.disaster.regions import GAP_M, RESOLUTION_M, Cells, Grid, Region, RegionMap

KEEP_OFF_M, BEST_M, WITHIN_M = 2.0, 2.75, 4.0
"""From the area's edge. A parcel from 10 m comes to rest within 1.4 m of its place, nine times of ten
(vehicles/README.md); the edge itself is known to a metre, and both err to either side: best is about the middle of 0
and 5 m. So near to a ruin little ground is surely none of it: parcels lay 3.4 m from ruins in the mean (40 flights of
Table 5, docs/disaster-measured.md). Ours."""
SPREADS_M = 0.5
"""Best is so much farther from what spreads meanwhile: parcels that went 3.25 m from fires lay 2.0 m from them in the
mean, 0.7 at least (ten of Table 4, docs/disaster-measured.md). Ours."""
HELD_WITHIN_M = 4.5
"""The same of a place that is gone to, as edges move while more is seen of them, and of what is looked at last, before
the parcel is taken home (the town of seed 4 had no other); ours. Of places chosen that far away parcels came to rest
5.4 and 5.7 m from the water, edges being 0.8 and 1.4 m off (`disaster-together`, seed 1); 4.0 m away one still did
(5.7 m: an edge 1.4 m off, and the parcel 0.6 m from its place)."""
PLAIN_M = 2.0
"""Room for the parcel's tumbling; ours."""
BESIDE_M = 5.0
"""From the middle of the vehicle, which is 1 m wide, to a wall: two sigmas of a receiver's 1 m, and what the autopilot
may be off its place while it stands; ours."""
LAND_M2 = 400.0
"""Of dry ground that hangs together, by cells with a common side; ours."""
ROUGH = 0.06
"""Share of edges from which ground is not plain, in the mean of all looks; ours. Those from low are not told apart:
where they were, 28 in 100 cells seen from there were rough instead of 20 (Table 5, seed 17), and parcels that had been
delivered at the first try stayed on board after 14, 21 and 22 (seed 4, three of four arms)."""
HELD = 0.75
"""Of that room, of a place that is gone to: what is measured wobbles, a fire's front moves on; ours. 1.5 m are left,
enough for a parcel's tumbling."""
LOOKS = 6
SURELY = -1.5
"""Log-odds of an area below which a cell is surely none of it: 18 in 100."""
ASLANT = 0.5
"""Tangent of the angle from straight down: what hides a fifth of the ground in a town (`regions.FRONTAL`). Places in a
flood's midst (town of seed 7) had been seen from 0.67 to 1.03 at best, and the one at its shore from 0.32. Ours."""
TURNED_DEG = LEAST_DEG
"""Of a look from the first one: at this angle a corner's height is known at last (`terrain/survey.py`). Before, plain
roofs in a flood's midst were places (town of seed 11)."""
DOUBT = 0.25
"""Mean share of an area from which a cell may be of it (`tools/disaster/shallows.py` measures shares at a shore)."""
LOW_DOUBT = 0.1
"""The same as seen from low: from 7.5 m 0.98 of what shows water 4 to 6 cm deep has as much, and 0.94 has `DOUBT`; of
ground 2 cm and more above it nothing has either (`tools/disaster/shallows.py`, towns of seeds 1 to 3)."""
HALF = 0.5
"""Mean share of an area at its edge: so much of a part that the edge goes through, and as unsure frames are there."""
LASTS_US, NEAR_M = 1_500_000, 3.0
"""So long a place, or one so near to it, has to be one before it is gone to: what stands is mapped anew once a second
(`relief.EVERY_US`), and roofs that had just come into sight were places for as long (towns of seeds 2 and 3). Ours."""
WANDER = 0.1
"""What a metre of way costs, in metres off `BEST_M`; ours."""


class Standing(NamedTuple):
    """Cells where something is mapped that stands, and where ground is."""

    any: Cells
    tall: Cells
    """So high that the vehicle is beside it when it lets go."""
    ground: Cells
    """Where ground is mapped."""


class Place(NamedTuple):
    """Where a parcel is to lie, and the edge of the area that it is for; metres north and east."""

    label: str
    score: float
    place_m: Corner
    edge_m: Corner
    edge_steepness: float
    """Tangent of the angle from straight down at which the edge was seen best."""
    area_m2: float

    @property
    def is_middle(self) -> bool:
        """Whether the parcel is to lie on what is located, a box's middle (`as_printed.py`), not beside an edge."""
        return self.place_m == self.edge_m

    @property
    def where(self) -> str:
        """In words."""
        return f"{'in the middle' if self.is_middle else 'at the edge'} of {self.label}"


def choose(
    regions: RegionMap,
    region: Region,
    near_m: Corner,
    allowed: Cells | None = None,
    stands: Standing | None = None,
    *,
    closer: bool = False,
) -> Place | None:
    """The place for a region that is best from where the vehicle is; None where there is none (yet).

    `allowed`: cells at which it may be. `stands`: None where nothing is mapped. `closer`: one that may be a place, as
    far as can be told from aslant and from one side, and is worth a look from above.
    """
    whole = _whole(regions, region)
    off_region = _away_m(whole)
    within_m = HELD_WITHIN_M if closer else WITHIN_M
    ring: Cells = (off_region >= KEEP_OFF_M) & (off_region <= within_m) & (regions.looks >= LOOKS)
    if not closer:
        ring &= (regions.steepness <= ASLANT) & (regions.turned <= math.cos(math.radians(TURNED_DEG)))
    if allowed is not None:
        ring &= allowed
    if not ring.any():
        return None
    ring &= _free(regions, stands) & _land(regions, stands)
    rows, columns = np.nonzero(ring)
    if not len(rows):
        return None
    north, east = regions.north_m[rows, columns], regions.east_m[rows, columns]
    best_m = BEST_M + SPREADS_M if region.label in SPREADING else BEST_M
    cost = np.abs(off_region[rows, columns] - best_m) + regions.rough[rows, columns] / ROUGH
    cost += WANDER * np.hypot(north - near_m[0], east - near_m[1])
    best = int(np.argmin(cost))
    place = float(north[best]), float(east[best])
    edge, steepness = _edge(regions, whole, place)
    return Place(region.label, region.score, place, edge, steepness, region.area_m2)


def kept(
    regions: RegionMap, region: Region, place: Place, allowed: Cells | None = None, stands: Standing | None = None
) -> Place | None:
    """A place that was chosen, as it is after more looks; None where it is none any more.

    It needs `HELD` of the room that one is chosen with: what is measured wobbles, and would be given up as soon as it
    is looked at.
    """
    cell = regions.cell(*place.place_m)
    if cell is None or not _free(regions, stands, HELD)[cell] or not _land(regions, stands)[cell]:
        return None
    whole = _whole(regions, region)
    if _away_m(whole)[cell] > HELD_WITHIN_M or (allowed is not None and not allowed[cell]):
        return None
    edge, steepness = _edge(regions, whole, place.place_m)
    return Place(region.label, region.score, place.place_m, edge, steepness, region.area_m2)


class Lasting:
    """How long places have been such, as they are chosen again and again."""

    def __init__(self) -> None:
        self._known: list[tuple[Place, int, int]] = []
        """Places, since when each is one, and when it was chosen last, µs."""

    def lasts(self, now_us: int, place: Place) -> bool:
        """Whether a place that is chosen now has been one for `LASTS_US`, without a longer gap than that."""
        fresh = [one for one in self._known if now_us - one[2] <= LASTS_US]
        same = [
            one for one in fresh if one[0].label == place.label and math.dist(one[0].place_m, place.place_m) <= NEAR_M
        ]
        since_us = min((since_us for _, since_us, _ in same), default=now_us)
        self._known = [*(one for one in fresh if one not in same), (place, since_us, now_us)]
        return now_us - since_us >= LASTS_US


def is_free(regions: RegionMap, place_m: Corner, stands: Standing | None = None) -> bool:
    """Whether a place still is plain ground of no area, with `HELD` of the room that one is chosen with."""
    cell = regions.cell(*place_m)
    return cell is not None and bool(_free(regions, stands, HELD)[cell])


def is_way_clear(regions: RegionMap, from_m: Corner, to_m: Corner, stands: Standing | None) -> bool:
    """Whether a vehicle at the height at which it lets go may fly straight from one place to another near by."""
    if stands is None:
        return True
    tall_m = _away_m(stands.tall)
    count = math.ceil(math.dist(from_m, to_m) / RESOLUTION_M) + 1
    north, east = np.linspace(from_m[0], to_m[0], count).tolist(), np.linspace(from_m[1], to_m[1], count).tolist()
    cells = [regions.cell(*place_m) for place_m in zip(north, east, strict=True)]
    return all(cell is not None and tall_m[cell] >= HELD * BESIDE_M for cell in cells)


def is_beside(regions: RegionMap, region: Region, place_m: Corner) -> bool:
    """Whether a parcel at a place is delivered to a region."""
    cell = regions.cell(*place_m)
    return cell is not None and bool(_away_m(_whole(regions, region))[cell] <= DELIVERED_WITHIN_M)


def _areas(regions: RegionMap) -> Cells:
    """Cells that may be of an area."""
    return np.asarray(np.any(regions.odds > SURELY, axis=0) | (regions.doubt > DOUBT) | (regions.low_doubt > LOW_DOUBT))


def _land(regions: RegionMap, stands: Standing | None) -> Cells:
    """Cells of ground that reaches far enough to be believed."""
    dry = ~_areas(regions) & (regions.looks >= LOOKS)
    if stands is not None:
        dry &= _away_m(stands.ground) <= _away_m(stands.tall)
    _, numbers, about, _ = cv2.connectedComponentsWithStats(dry.astype(np.uint8), connectivity=4)
    wide = about[:, cv2.CC_STAT_AREA] * RESOLUTION_M**2 >= LAND_M2
    return np.asarray(dry & wide[numbers])


def _free(regions: RegionMap, stands: Standing | None, room: float = 1.0) -> Cells:
    areas = _areas(regions)
    things = np.asarray((regions.rough > ROUGH / room) | (regions.looks == 0))
    free = (_away_m(areas) >= room * KEEP_OFF_M) & (_away_m(things) >= room * PLAIN_M)
    if stands is not None:
        tall_m = _away_m(stands.tall)
        free &= (_away_m(stands.any) >= room * PLAIN_M) & (tall_m >= room * BESIDE_M)
        free &= _away_m(stands.ground) <= tall_m
    return free


def sigma_m(place: Place, height_m: float, ground_sigma_m: float, eph_m: float = 0.0) -> float:
    """One sigma of the distance by which the located point is off. `eph_m` 0: as the same receiver finds it again."""
    return covariance(place, height_m, ground_sigma_m, eph_m).horizontal_sigma_m


def covariance(place: Place, height_m: float, ground_sigma_m: float, eph_m: float) -> Covariance:
    """The same as a matrix. `height_m`: of the camera above the ground. North and east are alike."""
    slant_m = height_m * math.hypot(1.0, place.edge_steepness)
    along = RESOLUTION_M**2 / 12.0 + (slant_m * RAY_SIGMA_RAD) ** 2 + (ground_sigma_m * place.edge_steepness) ** 2 / 2.0
    return Covariance(along, 0.0, 0.0, along, 0.0, ground_sigma_m**2).with_receiver(eph_m, 0.0)


def _whole(regions: RegionMap, region: Region) -> Cells:
    """A region's cells, and those about them that frames show as an area in the mean, though none is sure of them."""
    return np.asarray(region.cells | ((regions.doubt >= HALF) & (_away_m(region.cells) <= GAP_M)))


def _edge(regions: RegionMap, whole: Cells, place: Corner) -> tuple[Corner, float]:
    rows, columns = np.nonzero(whole)
    north, east = regions.north_m[rows, columns], regions.east_m[rows, columns]
    away = np.hypot(north - place[0], east - place[1])
    first = int(np.argmin(away))
    # the cell's side towards the place
    share = min(1.0, RESOLUTION_M / 2.0 / max(float(away[first]), RESOLUTION_M))
    edge = (
        float(north[first]) + share * (place[0] - float(north[first])),
        float(east[first]) + share * (place[1] - float(east[first])),
    )
    return edge, float(regions.steepness[rows[first], columns[first]])


def _away_m(cells: Cells) -> Grid:
    """Of every cell: how far the nearest of some cells is, from middle to middle less half a cell."""
    if not cells.any():
        return np.full(cells.shape, np.inf)
    away = cv2.distanceTransform((~cells).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(np.maximum(away.astype(np.float64) - 0.5, 0.0) * RESOLUTION_M)
