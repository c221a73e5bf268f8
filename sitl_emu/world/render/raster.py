"""Which triangle each pixel sees: instances of meshes are chosen, projected and drawn into a depth buffer.

Axes of a camera: x right, y down in the picture, z along the optical axis; a pixel's centre lies at half a pixel.
A triangle faces the camera where its corners go round clockwise in the picture (its normal is (b - a) x (c - a)).
"""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.world.render.kernel import F32, F64, I32, ZERO, f4, f8, inlined, kernel, part

NOTHING = -1
NEAR_M = f4(0.05)
DECAL_M = f4(0.005)
DECAL_SHARE = f4(0.002)
"""How much nearer than it is a decal is taken for, in metres and of its distance: it covers what it lies on."""
SMALL = 256.0
"""Pixels of a triangle's frame up to which it pays to look whether all of it is hidden."""
HALF_PIXEL, LESS_THAN_HALF = 0.5 + 1e-9, 0.5 - 1e-9
"""A triangle is drawn a hair too large, so that rounding leaves no gap to its neighbour."""

CULLED, DECAL, HIDDEN = 1, 2, 4
"""Flags of an instance: its back faces are not seen; it lies on another surface; it is not there now."""


class Meshes(NamedTuple):
    """All triangles there are, each in the axes of its mesh."""

    corners: F32
    """(v, 3), metres."""
    uv: F32
    """(v, 2), in repeats of the material's texture."""
    triangles: I32
    """(t, 3), corners' numbers."""
    normals: F32
    """(t, 3), unit vectors for the light."""
    materials: I32
    """(t,)"""
    tints: F32
    """(t, 3), red, green, blue: what the texture is multiplied with."""
    levels: I32
    """(l, 4): first and end of corners and of triangles of a level of detail, the finest first in a mesh."""
    level_errors: F32
    """(l,): how far it lies from the finest, m."""


class Instances(NamedTuple):
    """Meshes that stand somewhere."""

    first_level: I32
    """(i,) of the mesh, in `Meshes.levels`."""
    level_count: I32
    rotation: F64
    """(i, 3, 3), mesh to NED."""
    place: F64
    """(i, 3), NED."""
    radius: F64
    """(i,) of a sphere about its place that holds it."""
    flags: I32
    objects: I32
    """(i,) the object's number."""
    tint: F32
    """(i, 3)"""


class Pinhole(NamedTuple):
    """A camera's place and axes."""

    position: F64
    rotation: F64
    """(3, 3), camera to NED."""
    focal_px: float
    width: int
    height: int


class Drawn(NamedTuple):
    """The instances in the picture, and room for their corners."""

    instance: I32
    """(n,), by slot."""
    level: I32
    first_corner: I32
    """(n,): where a slot's corners begin in `seen` and `projected`."""
    seen: F32
    """(m, 3), in camera axes."""
    projected: F64
    """(m, 3): pixel right, pixel down, 1 / distance along the axis."""


class Buffers(NamedTuple):
    """Of each pixel, row by row."""

    nearness: F32
    """1 / distance along the axis; 0 where nothing is."""
    triangle: I32
    slot: I32


@kernel
def select(
    levels: I32,
    level_errors: F32,
    things: Instances,
    camera: Pinhole,
    error_px: float,
    chosen: I32,
    level: I32,
    at: I32,
) -> tuple[int, int]:
    """The instances within the view, and the coarsest level of each that errs by less than `error_px`.

    Returns how many there are, and how many corners they have.
    """
    p, r, focal = camera.position, camera.rotation, camera.focal_px
    slope_x, slope_y = 0.5 * camera.width / focal, 0.5 * camera.height / focal
    inwards_x, inwards_y = 1.0 / math.sqrt(1.0 + slope_x * slope_x), 1.0 / math.sqrt(1.0 + slope_y * slope_y)
    count, corners = 0, 0
    for i in range(len(things.place)):
        if things.flags[i] & HIDDEN:
            continue
        n, e, d = things.place[i, 0] - p[0], things.place[i, 1] - p[1], things.place[i, 2] - p[2]
        x = n * r[0, 0] + e * r[1, 0] + d * r[2, 0]
        y = n * r[0, 1] + e * r[1, 1] + d * r[2, 1]
        z = n * r[0, 2] + e * r[1, 2] + d * r[2, 2]
        radius = things.radius[i]
        if z < -radius or (abs(x) - z * slope_x) * inwards_x > radius or (abs(y) - z * slope_y) * inwards_y > radius:
            continue
        away = max(math.sqrt(x * x + y * y + z * z) - radius, 0.1)
        found = things.first_level[i]
        for k in range(found + 1, found + things.level_count[i]):
            if level_errors[k] * focal <= error_px * away:
                found = k
        chosen[count], level[count], at[count] = i, found, corners
        corners += levels[found, 1] - levels[found, 0]
        count += 1
    return count, corners


@inlined
def _row(
    rotation: F64, row: int, things: Instances, i: int, position: F64
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """A row of the way from an instance's mesh to camera axes: three factors and a shift."""
    a, b, c = rotation[0, row], rotation[1, row], rotation[2, row]
    own, place = things.rotation, things.place
    shift = a * (place[i, 0] - position[0]) + b * (place[i, 1] - position[1]) + c * (place[i, 2] - position[2])
    return (
        f4(a * own[i, 0, 0] + b * own[i, 1, 0] + c * own[i, 2, 0]),
        f4(a * own[i, 0, 1] + b * own[i, 1, 1] + c * own[i, 2, 1]),
        f4(a * own[i, 0, 2] + b * own[i, 1, 2] + c * own[i, 2, 2]),
        f4(shift),
    )


@kernel
def project(meshes: Meshes, things: Instances, camera: Pinhole, drawn: Drawn, count: int) -> None:
    """Fill `drawn.seen` and `drawn.projected`."""
    rotation = camera.rotation
    middle_x, middle_y = 0.5 * camera.width, 0.5 * camera.height
    for slot in range(count):
        i, own = drawn.instance[slot], drawn.level[slot]
        m00, m01, m02, t0 = _row(rotation, 0, things, i, camera.position)
        m10, m11, m12, t1 = _row(rotation, 1, things, i, camera.position)
        m20, m21, m22, t2 = _row(rotation, 2, things, i, camera.position)
        is_decal = things.flags[i] & DECAL
        first = meshes.levels[own, 0]
        into = drawn.first_corner[slot]
        for k in range(meshes.levels[own, 1] - first):
            a, b, c = meshes.corners[first + k, 0], meshes.corners[first + k, 1], meshes.corners[first + k, 2]
            x = m00 * a + m01 * b + m02 * c + t0
            y = m10 * a + m11 * b + m12 * c + t1
            z = m20 * a + m21 * b + m22 * c + t2
            drawn.seen[into + k, 0], drawn.seen[into + k, 1], drawn.seen[into + k, 2] = x, y, z
            if z > NEAR_M:
                nearness = 1.0 / f8(z)
                drawn.projected[into + k, 0] = x * nearness * camera.focal_px + middle_x
                drawn.projected[into + k, 1] = y * nearness * camera.focal_px + middle_y
                if is_decal:
                    nearness = 1.0 / max(z - f8(z) * DECAL_SHARE - DECAL_M, 0.5 * NEAR_M)
                drawn.projected[into + k, 2] = nearness


@inlined
def _is_hidden(
    low_x: float, high_x: float, first_row: int, last_row: int, nearest: float, width: int, nearness: F32
) -> bool:
    """Whether all pixels of a small triangle's frame show something nearer."""
    from_x, to_x = max(math.ceil(low_x - 0.5), 0), min(math.floor(high_x - 0.5), width - 1)
    for row in range(first_row, last_row + 1):
        for at in range(row * width + from_x, row * width + to_x + 1):
            if nearest > nearness[at]:
                return False
    return True


@inlined
def fill(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float, cx: float, cy: float, cz: float,
    is_culled: bool, number: int | np.int32, slot: int, width: int, height: int, out: Buffers,
) -> None:  # fmt: skip
    """Draw one triangle, given by pixels and nearness; in double precision, so that neighbours leave no gap.

    A number of NOTHING leaves no name, only its depth.
    """
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if area == 0.0 or (is_culled and area > 0.0):
        return
    low_x, high_x = min(ax, bx, cx), max(ax, bx, cx)
    low_y, high_y = min(ay, by, cy), max(ay, by, cy)
    if not (high_x >= 0.0 and high_y >= 0.0 and low_x <= width and low_y <= height):
        return
    first_row = math.ceil(max(low_y - 0.5, 0.0))
    last_row = math.floor(min(high_y - 0.5, height - 1.0))
    if first_row > last_row or math.ceil(low_x - 0.5) > math.floor(high_x - 0.5):
        return
    if (high_x - low_x) * (last_row + 1 - first_row) < SMALL and _is_hidden(
        low_x, high_x, first_row, last_row, max(az, bz, cz), width, out.nearness
    ):
        return
    if area > 0.0:
        bx, by, bz, cx, cy, cz = cx, cy, cz, bx, by, bz
        area = -area
    by_area = 1.0 / area
    z_x = ((bz - az) * (cy - ay) - (cz - az) * (by - ay)) * by_area
    z_y = ((cz - az) * (bx - ax) - (bz - az) * (cx - ax)) * by_area
    rise_a, rise_b, rise_c = by - ay, cy - by, ay - cy
    slope_a = (bx - ax) / rise_a if rise_a != 0.0 else 0.0
    slope_b = (cx - bx) / rise_b if rise_b != 0.0 else 0.0
    slope_c = (ax - cx) / rise_c if rise_c != 0.0 else 0.0
    for row in range(first_row, last_row + 1):
        y = row + 0.5
        low, high = max(low_x, 0.0), min(high_x, width + 0.0)
        # Inside lies right of an edge that goes down the picture, left of one that goes up
        if rise_a > 0.0:
            low = max(low, ax + slope_a * (y - ay))
        elif rise_a < 0.0:
            high = min(high, ax + slope_a * (y - ay))
        if rise_b > 0.0:
            low = max(low, bx + slope_b * (y - by))
        elif rise_b < 0.0:
            high = min(high, bx + slope_b * (y - by))
        if rise_c > 0.0:
            low = max(low, cx + slope_c * (y - cy))
        elif rise_c < 0.0:
            high = min(high, cx + slope_c * (y - cy))
        from_x, to_x = math.ceil(low - HALF_PIXEL), math.floor(high - LESS_THAN_HALF)
        to_x = min(to_x, width - 1)
        z = az + z_x * (from_x + 0.5 - ax) + z_y * (y - ay)
        at = row * width + from_x
        for _ in range(from_x, to_x + 1):
            nearness = f4(z)
            if nearness > out.nearness[at]:
                out.nearness[at] = nearness
                if number >= 0:
                    out.triangle[at], out.slot[at] = number, slot
            z += z_x
            at += 1


@part
def _clipped(corners: I32, at: int, drawn: Drawn, camera: Pinhole, is_decal: bool, polygon: F64) -> int:
    """What of a triangle lies beyond the near plane: up to four corners into `polygon` (4, 3); how many."""
    count, near = 0, f8(NEAR_M)
    seen = drawn.seen
    for k in range(3):
        i, j = at + corners[k], at + corners[(k + 1) % 3]
        z_i, z_j = f8(seen[i, 2]), f8(seen[j, 2])
        for turn in range(2):
            if turn == 0:
                if z_i <= near:
                    continue
                x, y, z = f8(seen[i, 0]), f8(seen[i, 1]), z_i
            else:
                if (z_i > near) == (z_j > near):
                    continue
                share = (near - z_i) / (z_j - z_i)
                x = seen[i, 0] + share * (f8(seen[j, 0]) - seen[i, 0])
                y = seen[i, 1] + share * (f8(seen[j, 1]) - seen[i, 1])
                z = near
            polygon[count, 0] = x / z * camera.focal_px + 0.5 * camera.width
            polygon[count, 1] = y / z * camera.focal_px + 0.5 * camera.height
            if is_decal:
                z = max(z - z * f8(DECAL_SHARE) - f8(DECAL_M), 0.5 * near)
            polygon[count, 2] = 1.0 / z
            count += 1
    return count


@part
def _is_out_of_sight(drawn: Drawn, first: int, end: int, width: int, height: int, nearness: F32) -> bool:
    """Whether a frame about corners `first` to `end` lies outside the picture, or shows nearer things alone."""
    low_x, high_x, low_y, high_y, nearest = 1e30, -1e30, 1e30, -1e30, 0.0
    for k in range(first, end):
        if not drawn.seen[k, 2] > NEAR_M:
            return False
        x, y = drawn.projected[k, 0], drawn.projected[k, 1]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
        nearest = max(nearest, drawn.projected[k, 2])
    if not (high_x > 0.0 and high_y > 0.0 and low_x < width and low_y < height):
        return True
    first_row, last_row = math.ceil(max(low_y - 0.5, 0.0)), math.floor(min(high_y - 0.5, height - 1.0))
    return _is_hidden(low_x, high_x, first_row, last_row, nearest, width, nearness)


@kernel
def rasterise(
    meshes: Meshes, things: Instances, camera: Pinhole, drawn: Drawn, count: int, out: Buffers, polygon: F64
) -> None:
    """Draw the first `count` slots of `drawn`, which are projected, into a cleared `out`; `polygon` (4, 3) is used."""
    out.nearness[:] = ZERO
    out.triangle[:] = NOTHING
    out.slot[:] = NOTHING
    width, height = camera.width, camera.height
    seen, p = drawn.seen, drawn.projected
    for slot in range(count):
        i, level, at = drawn.instance[slot], drawn.level[slot], drawn.first_corner[slot]
        is_culled, is_decal = (things.flags[i] & CULLED) != 0, (things.flags[i] & DECAL) != 0
        end = at + meshes.levels[level, 1] - meshes.levels[level, 0]
        if _is_out_of_sight(drawn, at, end, width, height, out.nearness):
            continue
        for number in range(meshes.levels[level, 2], meshes.levels[level, 3]):
            corners = meshes.triangles[number]
            a, b, c = at + corners[0], at + corners[1], at + corners[2]
            beyond = int(seen[a, 2] > NEAR_M) + int(seen[b, 2] > NEAR_M) + int(seen[c, 2] > NEAR_M)
            ax, ay, az, bx, by, bz = p[a, 0], p[a, 1], p[a, 2], p[b, 0], p[b, 1], p[b, 2]
            cx, cy, cz = p[c, 0], p[c, 1], p[c, 2]
            sides = 3
            if beyond < 3:
                sides = _clipped(corners, at, drawn, camera, is_decal, polygon) if beyond > 0 else 0
                ax, ay, az = polygon[0, 0], polygon[0, 1], polygon[0, 2]
                bx, by, bz = polygon[1, 0], polygon[1, 1], polygon[1, 2]
                cx, cy, cz = polygon[2, 0], polygon[2, 1], polygon[2, 2]
            # A triangle, or what is left of one as two: `fill` is compiled into here once
            for _ in range(2, sides):
                fill(ax, ay, az, bx, by, bz, cx, cy, cz, is_culled, number, slot, width, height, out)
                bx, by, bz, cx, cy, cz = cx, cy, cz, polygon[3, 0], polygon[3, 1], polygon[3, 2]
