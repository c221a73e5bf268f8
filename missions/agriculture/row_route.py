"""The way of a vehicle with steered wheels through a field of rows: along them, and round by the headland.

In the crop it drives along the lane between two rows (`field_map.py`), in the direction that it faces, and turns on the
headland alone: it can neither turn on the spot nor drive backwards. So a target that is not ahead in the vehicle's own
lane is come to by leaving the crop at the lane's end, driving round to an end of the target's lane, and in along that.

Its turns are those of PX4's rover, which begins a corner of 90 degrees 2 m before it (RA_ACC_RAD_MAX) and comes to the
new leg as exp(-way / look-ahead), with a look-ahead of 2.5 m. Hence:

- the corner of the way out lies `OUT_M` beyond the last plant, so that the turn begins on the headland;
- the way in begins `IN_M` before the first plant, where there is so much room, to be straight in the lane by then;
- it turns into a lane only after `RUN_UP_M` along the headland; for a lane that is nearer, it drives past and comes
  back by a loop from the inner to the outer line.

Places are metres along and across the rows; nothing here knows of messages or time.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from sitl_emu.missions.agriculture.field_map import Box, FieldMap, Spot

OUT_M = 2.5
IN_M = 5.5
RUN_UP_M = 5.0
CLEAR_M = 0.5
"""From the crop, of a way that passes it: half a rover and some more."""
EDGE_M = 0.5
"""From what may be driven on, outwards: half a rover's width and some more."""
SEEN_M = 2.5
"""From what may be driven on, so far off a target can still be looked at: as far as it may lie off (`match_m`)."""

FORWARD, BACKWARD = 1, -1
"""Driving along the rows, or against their heading."""


class NoWay(Exception):
    """There is no way there that a vehicle which can't turn on the spot may drive; the text is for people."""


class Way(NamedTuple):
    """What to drive along, from where the vehicle is: the last spot is where it stops."""

    spots: tuple[Spot, ...]
    direction: int
    """FORWARD or BACKWARD at its end; 0 where that is no lane."""


def to_target(field: FieldMap, here: Spot, facing: int, target: Spot, short_m: float, direction: int = 0) -> Way:
    """To the lane nearest to a target, `short_m` before it.

    `facing`: how the vehicle stands, FORWARD or BACKWARD. `direction`: from which side to come, 0: as is shorter.
    Raises NoWay, also where it would have to stop outside what may be driven on.
    """
    if not field.drivable.wider(SEEN_M).contains(target):
        raise NoWay("the target lies outside the map")
    lane_m = field.lane_m(target[1])
    in_crop = is_among_rows(field, here)
    if in_crop and direction in (0, facing) and field.lane_m(here[1]) == lane_m:
        ahead_m = (target[0] - here[0]) * facing
        if ahead_m >= 0.0:
            # Where the vehicle is nearer than it should come, it stays.
            ahead = Way(((target[0] - facing * min(short_m, ahead_m), lane_m),), facing)
            return _shortest(field, here, [ahead])
    start = [_end(field, field.lane_m(here[1]), facing, OUT_M)] if in_crop else []
    ways = [
        Way((*start, *way, (target[0] - into * short_m, lane_m)), into)
        for into in (FORWARD, BACKWARD)
        if direction in (0, into)
        for way in _ways_in(field, (start or [here])[-1], _end(field, lane_m, -into, IN_M), into)
    ]
    return _shortest(field, here, ways)


def to_place(field: FieldMap, here: Spot, facing: int, place: Spot) -> Way:
    """To a place on the headland or beyond; to one in the crop as to a target, by its lane. Raises NoWay."""
    if is_among_rows(field, place):
        return to_target(field, here, facing, place, 0.0)
    start = [_end(field, field.lane_m(here[1]), facing, OUT_M)] if is_among_rows(field, here) else []
    round_ = _around(field, (start or [here])[-1], place)
    return Way((*start, *round_, place), 0)


def is_among_rows(field: FieldMap, spot: Spot) -> bool:
    """Whether a vehicle there stands between plants, on any of the lanes."""
    crop = field.crop
    half_m = field.row_spacing_m / 2.0
    return crop.along0_m < spot[0] < crop.along1_m and crop.across0_m - half_m < spot[1] < crop.across1_m + half_m


def crosses(box: Box, a: Spot, b: Spot) -> bool:
    """Whether the line from a to b has a part within a box (Liang and Barsky's clipping)."""
    first, last = 0.0, 1.0
    for start, end, low, high in zip(a, b, box[::2], box[1::2], strict=True):
        step = end - start
        if step == 0.0:
            if not low < start < high:
                return False
            continue
        enters, leaves = sorted(((low - start) / step, (high - start) / step))
        first, last = max(first, enters), min(last, leaves)
    return first < last


def length_m(here: Spot, spots: Sequence[Spot]) -> float:
    """Of the way from here over all spots."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise((here, *spots)))


def _shortest(field: FieldMap, here: Spot, ways: Sequence[Way]) -> Way:
    """Of those that end on what may be driven on. Raises NoWay."""
    within = [way for way in ways if field.drivable.contains(way.spots[-1])]
    if not within:
        raise NoWay("there is no room on the map to turn into the target's lane, or to stop there")
    return min(within, key=lambda way: length_m(here, way.spots))


def _end(field: FieldMap, lane_m: float, end: int, beyond_m: float) -> Spot:
    """The place on a lane's line so far beyond the crop's end: FORWARD the far one, BACKWARD the near one."""
    crop, ring = field.crop, _ring(field)
    if end == FORWARD:
        return min(crop.along1_m + beyond_m, ring.along1_m), lane_m
    return max(crop.along0_m - beyond_m, ring.along0_m), lane_m


def _ring(field: FieldMap) -> Box:
    """What ways around the crop keep to: as far from it as a way in begins, where there is so much room."""
    crop, most = field.crop.wider(IN_M), field.drivable.wider(-EDGE_M)
    low, high = map(max, crop[::2], most[::2]), map(min, crop[1::2], most[1::2])
    (along0_m, across0_m), (along1_m, across1_m) = low, high
    return Box(along0_m, along1_m, across0_m, across1_m)


def _ways_in(field: FieldMap, start: Spot, entry: Spot, into: int) -> Iterator[tuple[Spot, ...]]:
    """Ways from a place outside the crop to where a lane's line begins, and along the headland to it."""
    straight = _around(field, start, entry)
    before = (straight or [start])[-1]
    if abs(before[1] - entry[1]) >= RUN_UP_M:
        yield (*straight, entry)
    ring = _ring(field)
    inner = _end(field, entry[1], -into, OUT_M)[0]
    for aside_m in (entry[1] - RUN_UP_M, entry[1] + RUN_UP_M):
        if ring.across0_m <= aside_m <= ring.across1_m:
            loop = (inner, aside_m)
            yield (*_around(field, start, loop), loop, (entry[0], aside_m), entry)


def _around(field: FieldMap, start: Spot, goal: Spot) -> tuple[Spot, ...]:
    """The corners to drive by on the shortest way round the crop; none where the straight line does not cross it."""
    ring, crop = _ring(field), field.crop
    corners = [(along_m, across_m) for along_m in ring[:2] for across_m in ring[2:]]
    wide = crop.wider(CLEAR_M)
    # Who stands nearer to the plants than that already, drives away from them.
    kept = crop if wide.contains(start) or wide.contains(goal) else wide
    ways = [
        way
        for count in range(3)
        for way in itertools.permutations(corners, count)
        if not any(crosses(kept, a, b) for a, b in itertools.pairwise((start, *way, goal)))
    ]
    return min(ways, key=lambda way: length_m(start, (*way, goal)), default=())
