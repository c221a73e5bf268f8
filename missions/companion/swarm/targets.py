"""Sightings of several aircraft to targets: which are the same, and where it is by all of them.

Two sightings are of one target when the distance between them is what their covariances make likely (`LIKELY`), or less
than `SAME_M`, whatever their labels; not beyond `FARTHEST_M`, so that one who knows little does not swallow what
others know well. Two of the same aircraft are never one target: its own confirmation has told them apart, with errors
that both share. A target's place is the mean weighed by the inverse covariances, those taken as independent: each
aircraft has a receiver and a camera of its own. Each sighting votes for its label with its confidence.

An area that reaches farther than a place can't be told so: sightings that come with an extent are one target where
their extents meet (`extents.py`), of whichever aircraft. Such a target has no mean place; its place is that of the
sighting which knows it best.

A function of the sightings alone, so that all who have heard the same see the same targets, whatever came first.
"""

import math
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.missions.companion.swarm.extents import Cell, joined
from sitl_emu.missions.companion.swarm.records import Key, Sighting

LIKELY = 18.42
"""Chi-square of two degrees of freedom: of 10,000 pairs of sightings of one target one differs by more. Two places are
rather taken for one than one place for two: a parcel for both lies near both."""
SAME_M = 2.5
"""As near as one aircraft's targets may not lie (`Confirming.merge_m`)."""
FARTHEST_M = 15.0
"""Ours: a third more than what two receivers with a CEP of 2.5 m (u-blox M8N) make likely."""


class Target(NamedTuple):
    """What several aircraft have sighted, as one. Its name is the lowest of its sightings' keys."""

    keys: tuple[Key, ...]
    label: int
    confidence: float
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    nn: float
    """Covariance, m²."""
    ne: float
    ee: float

    @property
    def key(self) -> Key:
        """Its name."""
        return self.keys[0]

    @property
    def sigma_m(self) -> float:
        """One sigma of the distance on the map."""
        return math.sqrt(self.nn + self.ee)


def merged(sightings: Iterable[Sighting], extents: Mapping[Key, Collection[Cell]] | None = None) -> list[Target]:
    """The targets of all sightings, places before areas, each by name. `extents`: of those that are areas."""
    extents, targets = extents or {}, list[_Merging]()
    by_key = {one.key: one for one in sorted(sightings)}
    areas = [one for one in by_key.values() if one.key in extents]
    for one in by_key.values():
        if one.key in extents:
            continue
        near = [
            (distance, number)
            for number, target in enumerate(targets)
            if one.key[0] not in target.systems and (distance := target.distance(one)) is not None
        ]
        if near:
            targets[min(near)[1]].add(one)
        else:
            targets.append(_Merging(one))
    groups = [
        [by_key[key] for key in keys]
        for label in sorted({one.label for one in areas})
        for keys in joined({one.key: extents[one.key] for one in areas if one.label == label})
    ]
    return [target.target for target in targets] + [_area(group) for group in groups]


class _Merging:
    """Sightings that are taken for one target."""

    def __init__(self, first: Sighting) -> None:
        self.sightings = [first]
        self.systems = {first.key[0]}
        self.target = _target(self.sightings)

    def add(self, one: Sighting) -> None:
        self.sightings.append(one)
        self.systems.add(one.key[0])
        self.target = _target(self.sightings)

    def distance(self, one: Sighting) -> float | None:
        """How far a sighting lies from it, in sigmas squared; None where it is another's."""
        mine = self.target
        north, east = to_metres(one.lat_deg, one.lon_deg, mine.lat_deg, mine.lon_deg)
        nn, ne, ee = _covariance(one)
        nn, ne, ee = nn + mine.nn, ne + mine.ne, ee + mine.ee
        squared = (ee * north * north - 2.0 * ne * north * east + nn * east * east) / (nn * ee - ne * ne)
        away_m = math.hypot(north, east)
        return squared if away_m <= SAME_M or (squared <= LIKELY and away_m <= FARTHEST_M) else None


def _area(sightings: list[Sighting]) -> Target:
    """An area, placed by the sighting that is believed in and known best."""
    best = min(sightings, key=lambda one: (one.confidence <= 0.0, one.sigma_north_m * one.sigma_east_m, one.key))
    covariance = _covariance(best)
    place = best.lat_deg, best.lon_deg, best.alt_amsl_m
    return Target(tuple(one.key for one in sightings), best.label, best.confidence, *place, *covariance)


def _target(sightings: list[Sighting]) -> Target:
    """Weighed by inverse covariances, in metres from the first."""
    first = sightings[0]
    a = b = c = x = y = heights = height_weights = 0.0
    votes = dict[int, float]()
    for one in sightings:
        nn, ne, ee = _covariance(one)
        det = nn * ee - ne * ne
        wn, wx, we = ee / det, -ne / det, nn / det
        north, east = to_metres(one.lat_deg, one.lon_deg, first.lat_deg, first.lon_deg)
        a, b, c = a + wn, b + wx, c + we
        x, y = x + wn * north + wx * east, y + wx * north + we * east
        heights, height_weights = heights + one.alt_amsl_m / (nn + ee), height_weights + 1.0 / (nn + ee)
        votes[one.label] = votes.get(one.label, 0.0) + one.confidence
    det = a * c - b * b
    place = from_metres((c * x - b * y) / det, (a * y - b * x) / det, first.lat_deg, first.lon_deg)
    label = max(sorted(votes), key=lambda each: votes[each])
    confidence = max(one.confidence for one in sightings if one.label == label)
    keys = tuple(sorted(one.key for one in sightings))
    return Target(keys, label, confidence, *place, heights / height_weights, c / det, -b / det, a / det)


def _covariance(one: Sighting) -> tuple[float, float, float]:
    """(nn, ne, ee) in m²."""
    north_m, east_m = one.sigma_north_m, one.sigma_east_m
    return north_m * north_m, one.correlation * north_m * east_m, east_m * east_m
