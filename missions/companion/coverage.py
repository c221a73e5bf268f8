"""Lawnmower lines over an area, so that a camera that looks straight down sees every place of it.

Areas are polygons of any shape, with holes, in metres (north, east). Lines are parallel, a footprint less the overlap
apart. Flown with the picture's top forward, a line's camera sees half a footprint to either side, and half of one
beyond its ends. Where an edge runs aslant and a line ends too early for that, short lines are added. So every place of
the area is seen, but for sharp tips that a margin puts out of reach (`unseen`).

Lines lie within the area and keep the margin from its edges and holes. The ways between them need not: over a bay or a
hole they go straight on. A fence that must hold for these, too, is the autopilot's.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import shapely
from shapely import Polygon
from shapely.affinity import affine_transform

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import CameraModel

SLIVER_M2 = 1e-3
"""Ours: what is smaller is no place that was missed."""
ROUNDING_M = 1e-6
TRIED_HEADINGS = 8
"""Of the sides of an area's hull. Lines along all of a hundred took 12 s instead of 2 (e4a4d9b4)."""
TRIED_LINES = 5
"""Across what is left over, to find the short line that sees most of it."""


class CoverageError(ValueError):
    """An area that no lines can be laid over; one line that says what is wrong with it."""


class Footprint(NamedTuple):
    """What a level camera sees of flat ground, across the way and along it."""

    across_m: float
    along_m: float


class Line(NamedTuple):
    """From a place to another, (north, east) in metres."""

    start_m: Corner
    end_m: Corner

    @property
    def length_m(self) -> float:
        """From end to end."""
        return math.dist(self.start_m, self.end_m)

    def turned(self) -> "Line":
        """The same from its other end."""
        return Line(self.end_m, self.start_m)


def footprint(camera: CameraModel, height_m: float) -> Footprint:
    """Of a camera that looks straight down from a height above the ground, without its lens' distortion.

    Over relief the highest ground counts: it is seen narrowest. Raises CoverageError for a height that is not above 0.
    """
    if not height_m > 0.0:
        raise CoverageError(f"height above ground {height_m:g} m; must be above 0")
    return Footprint(camera.width / camera.fx * height_m, camera.height / camera.fy * height_m)


def polygon(corners: Sequence[Corner], holes: Sequence[Sequence[Corner]] = ()) -> Polygon:
    """An area by its corners and those of its holes. Raises CoverageError for one that is no area."""
    for ring in (corners, *holes):
        if len(ring) < 3:
            raise CoverageError(f"area: {len(ring)} corners; a polygon has three or more")
        if not all(math.isfinite(metres) for corner in ring for metres in corner):
            raise CoverageError("area: a corner that is not finite")
    area = Polygon(corners, holes)
    if not area.is_valid or area.area < SLIVER_M2:
        reason = shapely.is_valid_reason(area) if not area.is_valid else "it has no extent"
        raise CoverageError(f"area: {reason}; its outline must not cross or touch itself, holes lie within it")
    return area


def inset(area: Polygon, margin_m: float) -> shapely.Geometry:
    """Where lines may lie in an area: `margin_m` from its edges and holes. Raises CoverageError where nowhere."""
    allowed = area.buffer(-margin_m, join_style="mitre") if margin_m else area
    if margin_m < 0.0 or allowed.area < SLIVER_M2:
        raise CoverageError(f"margin {margin_m:g} m; must be 0 or more, and leave something of the area")
    return allowed


def lawnmower(
    area: Polygon,
    seen: Footprint,
    overlap: float = 0.0,
    *,
    margin_m: float = 0.0,
    heading_deg: float | None = None,
    start_m: Corner | None = None,
) -> list[Line]:
    """The lines over an area, in the order and direction in which the way is short.

    `overlap`: the share of a footprint that the next line sees again, 0 to below 1. `margin_m`: how far lines stay from
    edges and holes. `heading_deg`: the lines' direction from north over east; None: along that side of the area's hull,
    of those across which it is narrowest, with which the way is shortest. `start_m`: where the way begins. Raises
    CoverageError.
    """
    if not 0.0 <= overlap < 1.0:
        raise CoverageError(f"overlap {overlap:g}; must be from 0 to below 1")
    allowed = inset(area, margin_m)
    headings = _hull_headings(area) if heading_deg is None else [heading_deg]
    plans = [ordered(list(_parallel(area, allowed, seen, overlap, heading)), start_m) for heading in headings]
    return min(plans, key=lambda lines: way_m(lines, start_m))


def unseen(area: Polygon, lines: Sequence[Line], seen: Footprint) -> list[Polygon]:
    """The parts of an area that no line sees."""
    left = area.difference(shapely.union_all([swept(line, seen) for line in lines]))
    return [part for part in shapely.get_parts(left) if part.area > SLIVER_M2]


def ordered(lines: Sequence[Line], start_m: Corner | None = None) -> list[Line]:
    """Lines in the order, and each from the end, with which the way is short: the nearest next, then 2-opt."""
    left, way = list(lines), []
    here = start_m
    while left:
        if here is None:
            at, first = 0, left[0]
        else:
            ends = [(math.dist(here, one.start_m), at, one) for at, one in enumerate(left)]
            ends += [(math.dist(here, one.end_m), at, one.turned()) for at, one in enumerate(left)]
            _, at, first = min(ends, key=lambda end: end[:2])
        way.append(first)
        left.pop(at)
        here = first.end_m
    while any(_uncrossed(way, start_m, i, j) for i in range(len(way)) for j in range(i, len(way))):
        pass
    return way


def way_m(lines: Sequence[Line], start_m: Corner | None = None) -> float:
    """The length of lines and of the ways between them, from `start_m` on."""
    froms = [start_m, *(line.end_m for line in lines)]
    between = [math.dist(a, line.start_m) for a, line in zip(froms, lines, strict=False) if a is not None]
    return sum(between) + sum(line.length_m for line in lines)


def _uncrossed(way: list[Line], start_m: Corner | None, i: int, j: int) -> bool:
    """Whether the way is shorter with lines i to j the other way round; then they are turned."""
    before = way[i - 1].end_m if i else start_m
    after = way[j + 1].start_m if j + 1 < len(way) else None
    now = changed = 0.0
    if before is not None:
        now, changed = math.dist(before, way[i].start_m), math.dist(before, way[j].end_m)
    if after is not None:
        now, changed = now + math.dist(way[j].end_m, after), changed + math.dist(way[i].start_m, after)
    if changed > now - ROUNDING_M:
        return False
    way[i : j + 1] = [line.turned() for line in reversed(way[i : j + 1])]
    return True


def _hull_headings(area: Polygon) -> list[float]:
    """The directions of the hull's sides in degrees, 0 to 180: those across which it is narrowest, so lines are few."""
    hull = list(area.convex_hull.exterior.coords)
    angles = {math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(hull)}

    def width_m(angle: float) -> float:
        across = [e * math.cos(angle) - n * math.sin(angle) for n, e in hull]
        return float(max(across) - min(across))

    return sorted({round(math.degrees(angle), 1) % 180.0 for angle in sorted(angles, key=width_m)[:TRIED_HEADINGS]})


def _parallel(
    area: Polygon, allowed: shapely.Geometry, seen: Footprint, overlap: float, heading_deg: float
) -> Iterator[Line]:
    """The lines in a direction, as they lie side by side. They are laid in axes (u, v) along them and across."""
    c, s = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
    area, allowed = (affine_transform(one, (c, s, -s, c, 0.0, 0.0)) for one in (area, allowed))
    spacing_m = seen.across_m * (1.0 - overlap)
    _, low, _, high = area.bounds
    _, nearest, _, farthest = allowed.bounds
    first = max(low + spacing_m / 2.0, nearest + ROUNDING_M)
    last = min(high - spacing_m / 2.0, farthest - ROUNDING_M)
    count = 1 + max(0, math.ceil((last - first) / spacing_m - ROUNDING_M))
    step = (last - first) / (count - 1) if count > 1 else 0.0
    first = first if count > 1 else (first + last) / 2.0
    lines = [line for i in range(count) for line in _chords(allowed, first + i * step)]
    while gleanings := [line for part in unseen(area, lines, seen) for line in _gleaned(part, allowed, seen)]:
        lines += gleanings
    for line in lines:
        yield Line(*((c * u - s * v, s * u + c * v) for u, v in line))


def _chords(allowed: shapely.Geometry, v: float, low: float = -math.inf, high: float = math.inf) -> list[Line]:
    """Where a line across lies in the area."""
    left, _, right, _ = allowed.bounds
    low, high = max(low, left - 1.0), min(high, right + 1.0)
    cut = shapely.get_parts(allowed.intersection(shapely.LineString([(low, v), (high, v)])))
    ends = [(part.bounds[0], part.bounds[2]) for part in cut if part.length > ROUNDING_M]
    return [Line((a, v), (b, v)) for a, b in sorted(ends)]


def _gleaned(part: Polygon, allowed: shapely.Geometry, seen: Footprint) -> list[Line]:
    """The short lines that see most of a part left over; none where nothing sees more than a sliver of it."""
    near = shapely.shortest_line(allowed, part).coords[0]
    ahead, beside = seen.along_m / 2.0, seen.across_m / 2.0
    about = allowed.intersection(shapely.box(near[0] - ahead, near[1] - beside, near[0] + ahead, near[1] + beside))
    tries = []
    for low_u, low_v, high_u, high_v in (part.bounds, about.bounds):
        steps = [low_v + i / (TRIED_LINES - 1) * (high_v - low_v) for i in range(TRIED_LINES)]
        tries += [_chords(allowed, v, low_u, high_u) for v in steps]

    def sees(lines: list[Line]) -> float:
        return float(part.intersection(shapely.union_all([swept(line, seen) for line in lines])).area)

    best = max(tries, key=sees)
    return best if sees(best) > SLIVER_M2 / 2.0 else []


def swept(line: Line, seen: Footprint) -> Polygon:
    """What a camera sees from a line: half a footprint to its sides, and beyond its ends."""
    (n0, e0), (n1, e1) = line
    length = line.length_m or 1.0
    along, across = seen.along_m / 2.0 / length, seen.across_m / 2.0 / length
    dn, de = n1 - n0, e1 - e0
    return Polygon(
        [(n + end * along * dn - side * across * de, e + end * along * de + side * across * dn)
         for n, e, end, side in ((n0, e0, -1, -1), (n1, e1, 1, -1), (n1, e1, 1, 1), (n0, e0, -1, 1))]
    )  # fmt: skip
