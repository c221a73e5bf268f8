"""Polygons on the ground: corners (north, east) in m. Pure functions."""

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
Corner = tuple[float, float]


def inside(polygon: Sequence[Corner], north: FloatArray, east: FloatArray) -> BoolArray:
    """Which of many points (arrays of one shape) lie within; by counting edges to the east (even-odd rule)."""
    within = np.zeros(np.shape(north), bool)
    with np.errstate(invalid="ignore", over="ignore"):  # a slope beyond floats: without a value an edge counts not
        for (n0, e0), (n1, e1) in edges(polygon):
            if n0 != n1:
                within ^= ((n0 > north) != (n1 > north)) & (east < e0 + (north - n0) * ((e1 - e0) / (n1 - n0)))
    return within


def contains(polygon: Sequence[Corner], north_m: float, east_m: float) -> bool:
    """Whether one point lies within: `inside` for physics, without arrays."""
    within = False
    for (n0, e0), (n1, e1) in edges(polygon):
        if (n0 > north_m) != (n1 > north_m) and east_m < e0 + (north_m - n0) * ((e1 - e0) / (n1 - n0)):
            within = not within
    return within


def edges(polygon: Sequence[Corner]) -> Iterable[tuple[Corner, Corner]]:
    """Each side's ends, the closing side last."""
    return zip(polygon, (*polygon[1:], *polygon[:1]), strict=True)


def area_m2(polygon: Sequence[Corner]) -> float:
    """Positive where the corners run from north over east."""
    return 0.5 * sum(n0 * e1 - n1 * e0 for (n0, e0), (n1, e1) in edges(polygon))


def is_simple(polygon: Sequence[Corner]) -> bool:
    """Whether it has an area and no two sides cross."""
    return len(polygon) >= 3 and not crosses_itself(polygon) and area_m2(polygon) != 0.0


def crosses_itself(polygon: Sequence[Corner]) -> bool:
    """Whether two sides cross."""
    sides = list(edges(polygon))
    return any(_cross(*one, *other) for at, one in enumerate(sides) for other in sides[at + 1 :])


def is_convex(polygon: Sequence[Corner]) -> bool:
    """Whether every corner turns to the same side; of a simple polygon."""
    sides = list(edges(polygon))
    turns = [_turn(*one, other[1]) for one, other in zip(sides, (*sides[1:], sides[0]), strict=True)]
    return all(turn >= 0.0 for turn in turns) or all(turn <= 0.0 for turn in turns)


def hull(points: Iterable[Corner]) -> tuple[Corner, ...]:
    """The convex hull, from north over east (Andrew's monotone chain)."""
    ordered = sorted(set(points))
    chains = []
    for chain_of in (ordered, ordered[::-1]):
        chain: list[Corner] = []
        for point in chain_of:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0.0:
                chain.pop()
            chain.append(point)
        chains.append(chain[:-1])
    return tuple(chains[0] + chains[1])


def moved(polygon: Sequence[Corner], north_m: float, east_m: float) -> tuple[Corner, ...]:
    """The same shape elsewhere."""
    return tuple((north + north_m, east + east_m) for north, east in polygon)


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    """Positive where the way over `b` turns from north towards east."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _cross(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Whether two sides cross in a point within both."""
    return _turn(a, b, c) * _turn(a, b, d) < 0.0 and _turn(c, d, a) * _turn(c, d, b) < 0.0
