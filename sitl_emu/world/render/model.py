"""Meshes as they are built: corners, triangles, and what each triangle is made of."""

import functools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sitl_emu.world.render.kernel import F32, F64, I32

Point = tuple[float, float, float]
Colour = tuple[float, float, float]
WHITE: Colour = (1.0, 1.0, 1.0)
UP = np.array((0.0, 0.0, -1.0))


@dataclass(frozen=True, slots=True)
class Model:
    """One mesh about its own origin, axes as NED; of a triangle, (b - a) x (c - a) looks outwards."""

    corners: F32
    uv: F32
    triangles: I32
    normals: F32
    """(t, 3), for the light."""
    materials: I32
    tints: F32

    @property
    def radius_m(self) -> float:
        """Of the sphere about its origin that holds it."""
        return float(np.sqrt((self.corners.astype(np.float64) ** 2).sum(axis=1).max())) if len(self.corners) else 0.0


def merged(models: Iterable[Model]) -> Model:
    """One of many. Raises ValueError where there are none."""
    parts = list(models)
    firsts = np.cumsum([0, *(len(part.corners) for part in parts[:-1])])
    return Model(
        np.concatenate([part.corners for part in parts]),
        np.concatenate([part.uv for part in parts]),
        np.concatenate([part.triangles + np.int32(first) for part, first in zip(parts, firsts, strict=True)]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.materials for part in parts]),
        np.concatenate([part.tints for part in parts]),
    )


def moved(model: Model, by: npt.ArrayLike, turn: npt.NDArray[np.floating] | None = None) -> Model:
    """Turned by a rotation matrix, if one is given, then shifted."""
    corners, normals = model.corners, model.normals
    if turn is not None:
        corners, normals = corners @ turn.T, normals @ turn.T
    shifted = (corners + np.asarray(by)).astype(np.float32)
    return Model(shifted, model.uv, model.triangles, normals.astype(np.float32), model.materials, model.tints)


def turned(heading_rad: float) -> npt.NDArray[np.float64]:
    """From north over east."""
    s, c = math.sin(heading_rad), math.cos(heading_rad)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def cross(a: F64, b: F64) -> F64:
    """numpy's, for rows of three, in a third of its time."""
    made = np.empty(np.broadcast_shapes(a.shape, b.shape))
    made[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    made[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    made[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return made


def dots(a: F64, b: F64) -> F64:
    """Of rows of three, as numpy sums products over a last axis, in a quarter of its time."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def lengths(rows: F64) -> F64:
    """The same of numpy's norm."""
    return np.asarray(np.sqrt(dots(rows, rows)))


def of_triangles(
    corners: npt.ArrayLike, triangles: npt.ArrayLike, material: int, tint: Colour = WHITE, repeat_m: float = 3.0
) -> Model:
    """Any triangles; each face's texture lies level along it and down its slope, `repeat_m` metres wide."""
    points, numbers = np.asarray(corners, np.float64), np.asarray(triangles, np.int32).reshape(-1, 3)
    a, b, c = (points[numbers[:, k]] for k in range(3))
    normals = cross(b - a, c - a)
    long = lengths(normals)
    keep = long > 1e-12
    numbers, normals = numbers[keep], normals[keep] / long[keep, None]
    own = points[numbers].reshape(-1, 3)
    uv, count = _along(points[numbers], normals), len(numbers)
    return Model(
        own.astype(np.float32), (uv / repeat_m).astype(np.float32), np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        normals.astype(np.float32), np.full(count, material, np.int32), np.tile(np.array(tint, np.float32), (count, 1)),
    )  # fmt: skip


def of_planes(
    faces: F64, triangles: npt.ArrayLike, normals: F64, material: int, lit: F32, tints: F32, repeat_m: float
) -> Model:
    """Flat faces (n, corners, 3) whose triangles share corners; `normals` (n, 3) of the faces, `lit` and `tints` (t, 3)
    of the triangles. Their texture lies as `of_triangles` has it."""
    uv, numbers = _along(faces, normals), np.asarray(triangles, np.int32).reshape(-1, 3)
    return Model(
        faces.reshape(-1, 3).astype(np.float32), (uv / repeat_m).astype(np.float32), numbers, lit,
        np.full(len(numbers), material, np.int32), tints,
    )  # fmt: skip


def _along(faces: F64, normals: F64) -> F64:
    """(n * corners, 2): how far corners (n, corners, 3) lie along their face's level line and down its slope, m."""
    across = cross(normals, UP)
    across[lengths(across) < 0.1] = (0.0, 1.0, 0.0)
    across /= lengths(across)[:, None]
    down = cross(across, normals)
    down[down[:, 2] < 0] *= -1.0
    return np.stack([dots(faces, axis[:, None, :]) for axis in (across, down)], axis=2).reshape(-1, 2)


def face(points: Sequence[Point], uv: Sequence[tuple[float, float]], material: int, tint: Colour = WHITE) -> Model:
    """A convex polygon, its corners clockwise as seen from outside in NED's sense: (b - a) x (c - a) outwards."""
    corners = np.array(points, np.float64)
    count = len(points) - 2
    normal = cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= max(float(np.linalg.norm(normal)), 1e-12)
    return Model(
        corners.astype(np.float32), np.array(uv, np.float32),
        np.array([(0, k + 1, k + 2) for k in range(count)], np.int32),
        np.tile(normal.astype(np.float32), (count, 1)), np.full(count, material, np.int32),
        np.tile(np.array(tint, np.float32), (count, 1)),
    )  # fmt: skip


def box(size: Sequence[float], material: int, tint: Colour = WHITE, repeat_m: float = 3.0, top: int = -1) -> Model:
    """A cuboid about its middle: extent north, east, and down; `top` is another material for above."""
    n, e, d = (0.5 * side for side in size)
    corners = [(i * n, j * e, k * d) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (1, 5, 7, 3), (0, 2, 6, 4)]
    faces = [(q[0], q[1], q[2], q[0], q[2], q[3]) for q in quads]
    walls = of_triangles(corners, faces[:5], material, tint, repeat_m)
    return merged((walls, of_triangles(corners, faces[5], material if top < 0 else top, tint, repeat_m)))


def lathe(
    profile: Sequence[tuple[float, float]], sides: int, material: int, tint: Colour = WHITE, repeat_m: float = 3.0
) -> Model:
    """A surface of revolution about the vertical: (radius, height) from the bottom up; ends with radius 0 close it."""
    angles = np.arange(sides) * (2.0 * math.pi / sides)
    corners = np.array([(r * math.cos(a), r * math.sin(a), -h) for r, h in profile for a in angles])
    triangles = []
    for ring in range(len(profile) - 1):
        for k in range(sides):
            a, b = ring * sides + k, ring * sides + (k + 1) % sides
            triangles += [(b, a, a + sides), (b, a + sides, b + sides)]
    return of_triangles(corners, triangles, material, tint, repeat_m)


@functools.lru_cache(maxsize=16)
def _sphere(sides: int, rings: int) -> Model:
    profile = [(math.sin(a), -math.cos(a)) for a in np.linspace(0.0, math.pi, rings + 1)]
    return lathe(profile, sides, 0)


def ellipsoid(radii: Sequence[float], material: int, tint: Colour = WHITE, sides: int = 10, rings: int = 6) -> Model:
    """About its middle: half axes north, east, down."""
    unit = _sphere(sides, rings)
    corners = (unit.corners * np.asarray(radii)).astype(np.float32)
    return of_triangles(corners, unit.triangles, material, tint, 1.0)


def hull(points: Sequence[Point], material: int, tint: Colour = WHITE, repeat_m: float = 3.0) -> Model:
    """The convex hull, point by point. Raises ValueError for points that span no body."""
    p = np.asarray(points, np.float64)
    return of_triangles(p, hull_triangles(p), material, tint, repeat_m)


def hull_triangles(p: F64) -> I32:
    """(t, 3), facing outwards. Raises ValueError for points that span no body."""
    return _hull_triangles(p.tobytes())


@functools.lru_cache(maxsize=256)
def _hull_triangles(points: bytes) -> I32:
    """Of 24 cars each has the same hulls."""
    p = np.frombuffer(points).reshape(-1, 3)
    size = float(np.ptp(p, axis=0).max()) if len(p) else 0.0
    first = int(np.argmin(p[:, 0])) if len(p) else 0
    second = int(np.argmax(lengths(p - p[first])))
    line = cross(p - p[first], p[second] - p[first])
    third = int(np.argmax(lengths(line)))
    normal = cross(p[second] - p[first], p[third] - p[first])
    fourth = int(np.argmax(np.abs((p - p[first]) @ normal)))
    volume = float((p[fourth] - p[first]) @ normal)
    if abs(volume) <= 1e-9 * size**3:
        raise ValueError("its points lie in a plane")
    if volume > 0.0:
        second, third = third, second
    faces = np.array(
        [(first, second, third), (first, third, fourth), (third, second, fourth), (second, first, fourth)], np.int32
    )
    normals = _normals(p, faces)
    for new in range(len(p)):
        sees = dots(p[new] - p[faces[:, 0]], normals) > 1e-9 * size * lengths(normals)
        if not sees.any():
            continue
        edges = {edge for a, b, c in faces[sees].tolist() for edge in ((a, b), (b, c), (c, a))}
        more = np.array([(i, j, new) for i, j in sorted(edges) if (j, i) not in edges], np.int32).reshape(-1, 3)
        faces = np.concatenate((faces[~sees], more))
        normals = np.concatenate((normals[~sees], _normals(p, more)))
    return faces


def _normals(p: F64, faces: I32) -> F64:
    """As long as twice the area of each."""
    a = p[faces[:, 0]]
    return cross(p[faces[:, 1]] - a, p[faces[:, 2]] - a)
