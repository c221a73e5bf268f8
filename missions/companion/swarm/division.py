"""An area divided among scanners: lanes over a polygon, and whose each lane is.

All aircraft reckon with the same polygon, spacing and members, so that all have the same lanes by the same numbers
without a word. Whose a lane is follows from who is there: a lost member's lanes go to the others, the rest stays as it
was, so that nobody's way changes without need. Metres north and east of any origin.
"""

import math
from collections.abc import Collection, Sequence

from shapely import Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

from sitl_emu.missions.companion.area import Corner

Lane = tuple[Corner, Corner]
MOST_LANES = 1024
"""What all can be told of in a few broadcasts; ours."""


def lanes(corners: Sequence[Corner], spacing_m: float, heading_deg: float = 0.0) -> list[Lane]:
    """Lanes whose swaths of at most `spacing_m` cover a polygon wholly, beside each other, along a heading.

    A lane reaches as far as its swath meets the polygon, so it may leave slanted edges by a little; where a hollow
    parts a swath, it is several lanes. Raises ValueError for what is no area, or has more than `MOST_LANES`.
    """
    area = Polygon(corners) if len(corners) > 2 else Polygon()
    if not area.is_valid or not area.area > 0.0:
        raise ValueError(f"{len(corners)} corners that make no area; its edge must not cross itself")
    # shapely turns (x, y) = (north, east) from x to y, as a heading does
    turned = affinity.rotate(area, -heading_deg, origin=(0.0, 0.0))
    low_n, low_e, high_n, high_e = turned.bounds
    count = max(1, math.ceil((high_e - low_e) / spacing_m - 1e-9))
    if count > MOST_LANES:
        raise ValueError(f"{count} lanes, {spacing_m:g} m apart; at most {MOST_LANES}: widen the spacing")
    width_m = (high_e - low_e) / count
    found = list[Lane]()
    for number in range(count):
        east = low_e + number * width_m
        swath = turned.intersection(box(low_n, east, high_n, east + width_m))
        for first, last in sorted(_extents(swath)):
            ends = [(first, east + width_m / 2.0), (last, east + width_m / 2.0)]
            found.append(_turned_back(ends, heading_deg))
    if len(found) > MOST_LANES:
        raise ValueError(f"{len(found)} lanes, {spacing_m:g} m apart; at most {MOST_LANES}: widen the spacing")
    return found


def shares(lanes: Sequence[Lane], members: Collection[int], there: Collection[int]) -> dict[int, list[int]]:
    """The numbers of each member's lanes: neighbouring ones, about equally long in all, for those who are there.

    `there`: the members that are not lost; what the lost would have scanned is divided among these in the same way.
    """
    divided = _divided(lanes, range(len(lanes)), sorted(members))
    left = {member: divided[member] for member in sorted(there)}
    for lost in sorted(set(members) - set(there)):
        for member, more in _divided(lanes, divided[lost], sorted(there)).items():
            left[member] = sorted([*left[member], *more])
    return left


def _divided(lanes: Sequence[Lane], numbers: Collection[int], members: Sequence[int]) -> dict[int, list[int]]:
    """Cut where equal lengths end, each lane to whom its middle falls."""
    parts: dict[int, list[int]] = {member: [] for member in members}
    if not members:
        return parts
    lengths = [math.dist(*lanes[number]) for number in numbers]
    whole, before = sum(lengths) or 1.0, 0.0
    for number, length in zip(numbers, lengths, strict=True):
        place = int((before + length / 2.0) / whole * len(members))
        parts[members[min(place, len(members) - 1)]].append(number)
        before += length
    return parts


def _extents(swath: BaseGeometry) -> list[tuple[float, float]]:
    """How far each piece reaches along the lane."""
    pieces = getattr(swath, "geoms", [swath])
    return [(piece.bounds[0], piece.bounds[2]) for piece in pieces if piece.area > 0.0]


def _turned_back(ends: Sequence[Corner], heading_deg: float) -> Lane:
    cosine, sine = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
    first, last = ((n * cosine - e * sine, n * sine + e * cosine) for n, e in ends)
    return first, last
