"""Soft pictures in space, mixed over what is drawn: row by row, the nearest first.

Going from front to back, a row has to be remembered as light that is there already and the share of what lies behind
that is still to be seen: a few columns of figures, which is what vector instructions want (kernel.streamed).
"""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.world.render.kernel import (
    F32,
    F64,
    HALF,
    I32,
    ONE,
    U8,
    U32,
    ZERO,
    f4,
    f8,
    i4,
    inlined,
    kernel,
    streamed_kernel,
    u4,
)
from sitl_emu.world.render.maps import mixed
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.sprites import FLAMES, HEAPS, SIDE

NEAR_M = 0.2
HIDES = f4(0.9)
"""How far a flame hides what is behind it; the rest shines through."""
LAST = f4(SIDE - 1.001)


class Laid(NamedTuple):
    """Sprites in a picture."""

    plane: F32
    """(n, 4): normal in camera axes, and that times a corner."""
    across: F32
    up: F32
    """(n, 4): how far along its sides a place lies, from -1 to 1: three factors and what is taken off."""
    opacity: F32
    softness: F32
    """(n,), a metre: how fast it fades before what it touches."""
    frame: I32
    """(n, 6): first and end column, first and end row, picture, object."""


class Row(NamedTuple):
    """What is known of a picture's row; each (width,)."""

    red: F32
    green: F32
    blue: F32
    """Of what is there already, 0 to 255."""
    through: F32
    """The share of what lies behind that is to be seen."""
    object: I32
    """-1: none."""


def room(width: int) -> Row:
    """For a row."""
    red, green, blue, through = np.zeros((4, width), np.float32)
    return Row(red, green, blue, through, np.zeros(width, np.int32))


def lay(some: F32, camera: Pinhole) -> Laid:
    """Sprites (n, sprites.SPRITE) as a camera sees them; those before it alone."""
    plane, across, up = np.empty((3, len(some), 4), np.float32)
    opacity, softness = np.empty((2, len(some)), np.float32)
    frame = np.empty((len(some), 6), np.int32)
    seen = slice(_lay(some, camera, Laid(plane, across, up, opacity, softness, frame)))
    return Laid(plane[seen], across[seen], up[seen], opacity[seen], softness[seen], frame[seen])


@inlined
def _seen(r: F64, north: float, east: float, down: float) -> tuple[float, float, float]:
    """A direction in camera axes."""
    return (
        north * r[0, 0] + east * r[1, 0] + down * r[2, 0],
        north * r[0, 1] + east * r[1, 1] + down * r[2, 1],
        north * r[0, 2] + east * r[1, 2] + down * r[2, 2],
    )


@kernel
def _lay(some: F32, camera: Pinhole, out: Laid) -> int:
    width, height, focal = camera.width, camera.height, camera.focal_px
    r, p = camera.rotation, camera.position
    count = 0
    for s in range(len(some)):
        one = some[s]
        x, y, z = _seen(r, one[0] - p[0], one[1] - p[1], one[2] - p[2])
        ux, uy, uz = _seen(r, f8(one[3]), f8(one[4]), f8(one[5]))
        vx, vy, vz = _seen(r, f8(one[6]), f8(one[7]), f8(one[8]))
        if z - abs(uz) - abs(vz) < NEAR_M:
            continue
        low_x, high_x, low_y, high_y = 1e9, -1e9, 1e9, -1e9
        for k in range(4):
            a, b = (1.0 if k & 1 else -1.0), (1.0 if k & 2 else -1.0)
            by_z = focal / (z + a * uz + b * vz)
            sx, sy = (x + a * ux + b * vx) * by_z + 0.5 * width, (y + a * uy + b * vy) * by_z + 0.5 * height
            low_x, high_x, low_y, high_y = min(low_x, sx), max(high_x, sx), min(low_y, sy), max(high_y, sy)
        if not (high_x > 0.0 and high_y > 0.0 and low_x < width and low_y < height):
            continue
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        by_u, by_v = 1.0 / (ux * ux + uy * uy + uz * uz), 1.0 / (vx * vx + vy * vy + vz * vz)
        out.plane[count, 0], out.plane[count, 1], out.plane[count, 2] = nx, ny, nz
        out.plane[count, 3] = nx * x + ny * y + nz * z
        out.across[count, 0], out.across[count, 1], out.across[count, 2] = ux * by_u, uy * by_u, uz * by_u
        out.across[count, 3] = (x * ux + y * uy + z * uz) * by_u
        out.up[count, 0], out.up[count, 1], out.up[count, 2] = vx * by_v, vy * by_v, vz * by_v
        out.up[count, 3] = (x * vx + y * vy + z * vz) * by_v
        out.opacity[count], out.softness[count] = one[9], 1.0 / max(0.5 * math.sqrt(1.0 / by_u), 0.1)
        frame = out.frame[count]
        frame[0], frame[1] = max(low_x, 0.0), min(high_x + 1.0, width + 0.0)
        frame[2], frame[3] = max(low_y, 0.0), min(high_y + 1.0, height + 0.0)
        frame[4], frame[5] = one[10], one[11]
        count += 1
    return count


@inlined
def _mix(laid: Laid, s: int, pictures: U32, smoke: F32, dx0: np.float32, dy: np.float32, by_focal: np.float32,
         depth: F32, at: int, row: Row) -> None:  # fmt: skip
    """Put a sprite behind what there is of a row; `dx0`, `dy`: the ray of its first pixel, whose depth is `at`."""
    plane, across, up = laid.plane[s], laid.across[s], laid.up[s]
    first, count, number = laid.frame[s, 0], laid.frame[s, 1] - laid.frame[s, 0], laid.frame[s, 5]
    offset, opacity, soft = plane[3], laid.opacity[s] * f4(1.0 / 255.0), laid.softness[s]
    along_0, across_0, up_0 = plane[1] * dy + plane[2], across[1] * dy + across[2], up[1] * dy + up[2]
    is_smoke = laid.frame[s, 4] >= FLAMES + HEAPS
    start, hides = i4(laid.frame[s, 4] * SIDE * SIDE), ONE if is_smoke else HIDES
    red, green, blue = (smoke[2], smoke[1], smoke[0]) if is_smoke else (ONE, ONE, ONE)
    # Slices begin at 0, and so does what the compiler knows of their indices
    behind, reds, greens, blues = depth[at:], row.red[first:], row.green[first:], row.blue[first:]
    through, objects = row.through[first:], row.object[first:]
    for k in range(count):
        dx = dx0 + f4(k) * by_focal
        far = offset / (plane[0] * dx + along_0)
        u, v = far * (across[0] * dx + across_0) - across[3], far * (up[0] * dx + up_0) - up[3]
        gap = behind[k] - far
        inside = (u > -ONE) & (u < ONE) & (v > -ONE) & (v < ONE) & (gap > ZERO)
        x = min(max((u + ONE) * f4(0.5 * SIDE) - HALF, ZERO), LAST) if inside else ZERO
        y = min(max((ONE - v) * f4(0.5 * SIDE) - HALF, ZERO), LAST) if inside else ZERO
        column, line = i4(x), i4(y)
        texel = i4(start + line * i4(SIDE) + column)
        b, g, r, a = mixed(
            pictures[u4(texel)], pictures[u4(texel + 1)], pictures[u4(texel + SIDE)], pictures[u4(texel + SIDE + 1)],
            x - f4(column), y - f4(line),
        )  # fmt: skip
        alpha = a * opacity * min(gap * soft, ONE) if inside else ZERO
        shown = through[k] * alpha
        reds[k] += shown * r * red
        greens[k] += shown * g * green
        blues[k] += shown * b * blue
        through[k] *= ONE - alpha * hides
        objects[k] = number if (alpha > HALF) & (objects[k] < 0) else objects[k]


@streamed_kernel
def draw(
    laid: Laid, pictures: U32, smoke: F32, camera: Pinhole, row: Row, depth: F32, objects: I32, picture: U8
) -> None:
    """Mix sprites, the nearest first, over a picture, softly where they touch what is there; `row` is used.

    `depth` and `objects` (height * width,), `picture` (height * width * 3,): the latter two change.
    """
    width, by_focal = camera.width, f4(1.0 / camera.focal_px)
    dx0, dy0 = (HALF - HALF * f4(width)) * by_focal, (HALF - HALF * f4(camera.height)) * by_focal
    for line in range(camera.height):
        dy = dy0 + f4(line) * by_focal
        first, end = width, 0
        for s in range(len(laid.opacity)):
            frame = laid.frame[s]
            if not frame[2] <= line < frame[3]:
                continue
            if end == 0:
                row.red[:], row.green[:], row.blue[:], row.through[:], row.object[:] = ZERO, ZERO, ZERO, ONE, -1
            first, end = min(first, frame[0]), max(end, frame[1])
            _mix(laid, s, pictures, smoke, dx0 + f4(frame[0]) * by_focal, dy, by_focal, depth,
                 line * width + frame[0], row)  # fmt: skip
        for i in range(first, end):
            at, kept = line * width + i, row.through[i]
            picture[3 * at] = np.uint8(min(f4(picture[3 * at]) * kept + row.blue[i] + HALF, f4(255.0)))
            picture[3 * at + 1] = np.uint8(min(f4(picture[3 * at + 1]) * kept + row.green[i] + HALF, f4(255.0)))
            picture[3 * at + 2] = np.uint8(min(f4(picture[3 * at + 2]) * kept + row.red[i] + HALF, f4(255.0)))
            if row.object[i] >= 0:
                objects[at] = row.object[i]
