"""Flat things as meshes: outlines that lie on the ground, and the surfaces of water."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sitl_emu.world.description import Thing
from sitl_emu.world.ground import Terrain
from sitl_emu.world.polygons import area_m2
from sitl_emu.world.rays import heights
from sitl_emu.world.render.model import Colour, Model, of_triangles

F64 = npt.NDArray[np.float64]
Corner = tuple[float, float]

SECTORS = 48
RING_M = 0.4
"""About how far the rings of a patch lie apart, so that it follows the ground."""
MOST_RINGS = 24
WATER_CELL_M = 8.0
"""Sides of water's triangles are cut until they are no longer than this, or a fiftieth of it all."""


def outline(thing: Thing, angle: npt.NDArray[np.floating]) -> F64:
    """How far a flat thing reaches at angles from north over east."""
    factor: F64 = np.ones(len(angle))
    for k, (amplitude, phase) in enumerate(thing.harmonics, start=2):
        factor += amplitude * np.cos(k * angle + phase)
    return thing.radius_m * factor


def patch_plan(thing: Thing) -> tuple[F64, npt.NDArray[np.int32]]:
    """A flat thing from above: corners (north, east) about its place, and triangles that face up."""
    angle = np.arange(SECTORS) * (2.0 * math.pi / SECTORS)
    reach = outline(thing, angle)
    rings = min(max(math.ceil(thing.radius_m / RING_M), 1), MOST_RINGS)
    corners = [np.zeros((1, 2))]
    for ring in range(1, rings + 1):
        share = ring / rings
        corners.append(np.stack((share * reach * np.cos(angle), share * reach * np.sin(angle)), axis=1))
    triangles = [(0, 1 + (k + 1) % SECTORS, 1 + k) for k in range(SECTORS)]
    for ring in range(rings - 1):
        for k in range(SECTORS):
            a, b = 1 + ring * SECTORS + k, 1 + ring * SECTORS + (k + 1) % SECTORS
            triangles += [(a, b, b + SECTORS), (a, b + SECTORS, a + SECTORS)]
    return np.concatenate(corners), np.array(triangles, np.int32)


def draped(plan: F64, terrain: Terrain, north_m: float, east_m: float) -> F64:
    """Corners (NED) about (north_m, east_m, 0): a plan laid on the ground there."""
    height = heights(terrain, plan[:, 0] + north_m, plan[:, 1] + east_m)
    return np.stack((plan[:, 0], plan[:, 1], -height), axis=1)


def water(polygon: Sequence[Corner], material: int, colour: Colour, murk_1_m: float) -> Model:
    """A level surface at height 0; its first texture coordinate is the water's extinction of light."""
    corners, triangles = triangulated(polygon)
    widest = float(np.ptp(corners, axis=0).max())
    corners, triangles = subdivided(corners, triangles, max(WATER_CELL_M, widest / 50.0))
    points = np.concatenate((corners, np.zeros((len(corners), 1))), axis=1)
    made = of_triangles(points, triangles, material, colour)
    made.uv[:] = (murk_1_m, 0.0)
    return made


def triangulated(polygon: Sequence[Corner]) -> tuple[F64, npt.NDArray[np.int32]]:
    """A simple polygon by cutting off ears; triangles face up. Raises ValueError where there is no ear to cut."""
    corners = np.array(polygon, np.float64)
    left = list(range(len(polygon)))
    if area_m2(polygon) > 0.0:  # from north over east faces down
        left.reverse()
    triangles = []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(corners, left, k)), None)
        if ear is None:
            raise ValueError("its sides cross")
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    return corners, np.array([*triangles, tuple(left)], np.int32)


def _turn(a: F64, b: F64, c: F64) -> float:
    """Below 0 where the way over b turns as a face does that looks up."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _is_ear(corners: F64, left: list[int], k: int) -> bool:
    i, j, m = left[k - 1], left[k], left[(k + 1) % len(left)]
    a, b, c = corners[i], corners[j], corners[m]
    if _turn(a, b, c) >= 0.0:
        return False
    others = (corners[n] for n in left if n not in (i, j, m))
    return not any(_turn(a, b, p) <= 0 and _turn(b, c, p) <= 0 and _turn(c, a, p) <= 0 for p in others)


def subdivided(corners: F64, triangles: npt.NDArray[np.int32], side_m: float) -> tuple[F64, npt.NDArray[np.int32]]:
    """Every side that is longer is halved, until none is: triangles that share a side stay joined."""
    points = [(float(x), float(y)) for x, y in corners]
    halves: dict[tuple[int, int], int] = {}
    done: list[tuple[int, int, int]] = []
    open_ = [(int(a), int(b), int(c)) for a, b, c in triangles]
    while open_:
        a, b, c = open_.pop()
        sides = [
            ((a, b, c), _length(points, a, b)),
            ((b, c, a), _length(points, b, c)),
            ((c, a, b), _length(points, c, a)),
        ]
        (i, j, k), longest = max(sides, key=lambda side: side[1])
        if longest <= side_m:
            done.append((a, b, c))
            continue
        key = (min(i, j), max(i, j))
        if key not in halves:
            halves[key] = len(points)
            points.append((0.5 * (points[i][0] + points[j][0]), 0.5 * (points[i][1] + points[j][1])))
        middle = halves[key]
        open_ += [(i, middle, k), (middle, j, k)]
    return np.array(points), np.array(done, np.int32)


def _length(points: list[Corner], i: int, j: int) -> float:
    return math.hypot(points[i][0] - points[j][0], points[i][1] - points[j][1])
