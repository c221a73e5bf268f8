"""A few rows of a picture at a time, their pixels sorted by what they see: each kind is shaded in loops of its own.

What a loop works out of a pixel lies in a column of its own (`Block`), so that the loops become vector instructions
(kernel.streamed).
"""

from typing import Any, NamedTuple

import numpy as np

from sitl_emu.world.render.kernel import F32, HALF, I32, ONE, U8, U32, ZERO, f4, inlined, part, streamed, u4
from sitl_emu.world.render.maps import GROUND, LEAF, WATER, Materials
from sitl_emu.world.render.raster import Buffers, Drawn, Instances, Meshes, Pinhole

ABOUT = 2048
"""Pixels that are shaded at a time: what is known of them stays in the processor's caches."""
FARTHEST_M = f4(1e5)


class Picture(NamedTuple):
    """What is made."""

    colour: U8
    """(height, width, 3), blue, green, red."""
    depth: F32
    """(height, width) along the optical axis, m; inf for the sky."""
    objects: I32
    """(height, width): the object's number; -1 for the sky."""


class Block(NamedTuple):
    """Some pixels and what is known of them; each (n,)."""

    at: I32
    """Row * width + column."""
    x: F32
    y: F32
    """The ray, in camera axes: (x, y, 1)."""
    z: F32
    """Distance along the axis, m."""
    facing: F32
    """The surface's normal times the ray, above 0."""
    dither: F32
    """About 1: blurs the borders between levels of a texture."""
    way_n: F32
    way_e: F32
    way_d: F32
    """The ray, as a unit vector in NED."""
    distance: F32
    footprint: F32
    """Metres that the pixel covers: between its short and its long side."""
    north: F32
    east: F32
    down: F32
    """The place that is seen."""
    height: F32
    rise_n: F32
    rise_e: F32
    """Of water's ripples."""
    open: F32
    """Up to what height the sky is shut there; then the share of it that is to be seen."""
    normal_n: F32
    normal_e: F32
    normal_d: F32
    """For the light."""
    u: F32
    v: F32
    """In repeats of the texture; of water, u is its extinction of light."""
    repeats: F32
    """A metre."""
    layer: I32
    """The texture's number."""
    is_leaf: I32
    mirror: F32
    """How much of the sky it mirrors."""
    glow: F32
    share: F32
    """Of the ground's map, where it ends."""
    tint_r: F32
    tint_g: F32
    tint_b: F32
    red: F32
    green: F32
    blue: F32
    """Its own colour, from 0 to 1; then its light."""
    sun: F32
    """The share of the sun that reaches it."""
    lambert: F32
    """How far it looks towards the sun."""
    packed: U32
    """The picture's figures: blue, green, red from the lowest byte on."""


KINDS = 4
"""Of pixels: ground, water, meshes and sky, each of which has a quarter of a room's columns, in this order."""


def rows_at_once(width: int) -> int:
    """How many rows of a picture are shaded at a time."""
    return max(1, ABOUT // width)


def room(width: int) -> Block:
    """For `rows_at_once` of them, of every kind."""
    count = KINDS * rows_at_once(width) * width
    return Block(**{name: _column(name, count) for name in Block._fields})


def _column(name: str, count: int) -> Any:
    kinds: dict[Any, type[np.generic]] = {I32: np.int32, U32: np.uint32}
    return np.zeros(count, kinds.get(Block.__annotations__[name], np.float32))


@part
def from_(b: Block, first: int) -> Block:
    """Its columns from there on."""
    return Block(
        b.at[first:], b.x[first:], b.y[first:], b.z[first:], b.facing[first:], b.dither[first:], b.way_n[first:],
        b.way_e[first:], b.way_d[first:], b.distance[first:], b.footprint[first:], b.north[first:], b.east[first:],
        b.down[first:], b.height[first:], b.rise_n[first:], b.rise_e[first:], b.open[first:], b.normal_n[first:],
        b.normal_e[first:], b.normal_d[first:], b.u[first:], b.v[first:], b.repeats[first:], b.layer[first:],
        b.is_leaf[first:], b.mirror[first:], b.glow[first:], b.share[first:], b.tint_r[first:], b.tint_g[first:],
        b.tint_b[first:], b.red[first:], b.green[first:], b.blue[first:], b.sun[first:], b.lambert[first:],
        b.packed[first:],
    )  # fmt: skip


FIGURES = 20
"""Of a triangle: how u (0-3) and v (4-7) follow from a point, repeats a metre (8), normal (9-11), tint (12-14); its
plane in camera axes: normal (15-17), that times a corner (18), one over its length (19)."""
REMEMBERED = 512
"""Triangles whose figures are kept for the rows below: two in three are met again."""


class Memory(NamedTuple):
    """Of triangles that were met, each at a place that follows from its number."""

    figures: F32
    """(REMEMBERED, FIGURES)"""
    met: I32
    """(REMEMBERED, 2): triangle and slot; -1: none."""


def memory() -> Memory:
    """An empty one."""
    return Memory(np.empty((REMEMBERED, FIGURES), np.float32), np.full((REMEMBERED, 2), -1, np.int32))


@inlined
def texture_of(drawn: Drawn, meshes: Meshes, things: Instances, slot: int, number: int, p: F32) -> None:
    """How a triangle's texture lies, and its normal for the light: see FIGURES."""
    at, first = drawn.first_corner[slot], meshes.levels[drawn.level[slot], 0]
    ia, ib, ic = meshes.triangles[number]
    a, b, c = drawn.seen[at + ia], drawn.seen[at + ib], drawn.seen[at + ic]
    e1x, e1y, e1z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    e2x, e2y, e2z = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
    by_square = ONE / max(nx * nx + ny * ny + nz * nz, f4(1e-24))
    uv_a, uv_b, uv_c = meshes.uv[first + ia], meshes.uv[first + ib], meshes.uv[first + ic]
    b1x, b1y, b1z = e2y * nz - e2z * ny, e2z * nx - e2x * nz, e2x * ny - e2y * nx
    b2x, b2y, b2z = ny * e1z - nz * e1y, nz * e1x - nx * e1z, nx * e1y - ny * e1x
    for k in range(2):
        d1, d2 = (uv_b[k] - uv_a[k]) * by_square, (uv_c[k] - uv_a[k]) * by_square
        ux, uy, uz = b1x * d1 + b2x * d2, b1y * d1 + b2y * d2, b1z * d1 + b2z * d2
        p[4 * k], p[4 * k + 1], p[4 * k + 2] = ux, uy, uz
        p[4 * k + 3] = uv_a[k] - (ux * a[0] + uy * a[1] + uz * a[2])
    p[8] = np.sqrt(max(p[0] * p[0] + p[1] * p[1] + p[2] * p[2], p[4] * p[4] + p[5] * p[5] + p[6] * p[6]))
    i = drawn.instance[slot]
    turn, n = things.rotation[i], meshes.normals[number]
    for k in range(3):
        p[9 + k] = turn[k, 0] * n[0] + turn[k, 1] * n[1] + turn[k, 2] * n[2]
        p[12 + k] = meshes.tints[number, k] * things.tint[i, k]


@inlined
def plane_of(drawn: Drawn, meshes: Meshes, slot: int, number: int, p: F32) -> None:
    """A triangle's plane in camera axes: see FIGURES."""
    at = drawn.first_corner[slot]
    ia, ib, ic = meshes.triangles[number]
    a, b, c = drawn.seen[at + ia], drawn.seen[at + ib], drawn.seen[at + ic]
    e1x, e1y, e1z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    e2x, e2y, e2z = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
    length = np.sqrt(max(nx * nx + ny * ny + nz * nz, f4(1e-24)))
    p[15], p[16], p[17], p[18], p[19] = nx, ny, nz, nx * a[0] + ny * a[1] + nz * a[2], ONE / length


@inlined
def _put(
    b: Block, k: int, at: int, x: np.float32, y: np.float32, z: np.float32, facing: np.float32, dither: np.float32
) -> None:
    b.at[k], b.x[k], b.y[k], b.z[k], b.facing[k], b.dither[k] = at, x, y, z, facing, dither


@inlined
def _put_texture(b: Block, k: int, p: F32, layer: int, gloss: np.float32, is_leaf: bool) -> None:
    x, y, z = b.x[k] * b.z[k], b.y[k] * b.z[k], b.z[k]
    b.u[k] = p[0] * x + p[1] * y + p[2] * z + p[3]
    b.v[k] = p[4] * x + p[5] * y + p[6] * z + p[7]
    b.repeats[k], b.layer[k], b.mirror[k], b.is_leaf[k] = p[8], layer, gloss, is_leaf
    b.normal_n[k], b.normal_e[k], b.normal_d[k] = p[9], p[10], p[11]
    b.tint_r[k], b.tint_g[k], b.tint_b[k] = p[12], p[13], p[14]


@streamed
def sort_pixels(
    seen: Buffers, drawn: Drawn, meshes: Meshes, things: Instances, materials: Materials, camera: Pinhole, first: int,
    end: int, b: Block, out: Picture, known: Memory,
) -> tuple[int, int, int, int]:  # fmt: skip
    """Depth and object of rows, and their pixels by kind: how many of ground, water, meshes, sky."""
    width = camera.width
    by_focal = f4(1.0 / camera.focal_px)
    middle_x, middle_y = f4(width) * HALF, f4(camera.height) * HALF
    each = len(b.at) // KINDS
    ground, water, mesh, sky = 0, each, 2 * each, 3 * each
    last_triangle, last_slot = -2, -2
    nx, ny, nz, offset, by_normal = ZERO, ZERO, ZERO, ZERO, ZERO
    kind, layer, gloss, object_, p = 0, 0, ZERO, -1, known.figures[0]
    for row in range(first, end):
        y = (f4(row) + HALF - middle_y) * by_focal
        for column in range(width):
            at = row * width + column
            x = (f4(column) + HALF - middle_x) * by_focal
            dither = f4(0.85) + f4(0.1) * f4(((row & 1) << 1) | (column & 1))
            number, slot = seen.triangle[at], seen.slot[at]
            if number < 0:
                _put(b, sky, at, x, y, ONE, ONE, dither)
                sky += 1
                out.depth[row, column], out.objects[row, column] = np.inf, -1
                continue
            if number != last_triangle or slot != last_slot:
                last_triangle, last_slot = number, slot
                material = meshes.materials[number]
                kind, object_ = materials.kind[material], things.objects[drawn.instance[slot]]
                layer, gloss = materials.layer[material], materials.gloss[material]
                place = (number * 7 + slot * 13) & (REMEMBERED - 1)
                p = known.figures[place]
                if known.met[place, 0] != number or known.met[place, 1] != slot:
                    known.met[place, 0], known.met[place, 1] = number, slot
                    plane_of(drawn, meshes, slot, number, p)
                    if kind != GROUND:
                        texture_of(drawn, meshes, things, slot, number, p)
                nx, ny, nz, offset, by_normal = p[15], p[16], p[17], p[18], p[19]
            along = nx * x + ny * y + nz
            z, facing = offset / along, abs(along) * by_normal
            # Of one that is seen edge on, or nearly so, anything might come
            z = z if ZERO < z < FARTHEST_M else FARTHEST_M
            out.depth[row, column], out.objects[row, column] = z, object_
            if kind == GROUND:
                _put(b, ground, at, x, y, z, facing, dither)
                ground += 1
            elif kind == WATER:
                _put(b, water, at, x, y, z, facing, dither)
                _put_texture(b, water, p, layer, gloss, False)
                water += 1
            else:
                _put(b, mesh, at, x, y, z, facing, dither)
                _put_texture(b, mesh, p, layer, gloss, kind == LEAF)
                mesh += 1
    return ground, water - each, mesh - 2 * each, sky - 3 * each


@streamed
def find_places(b: Block, n: int, camera: Pinhole) -> None:
    """Where in the world pixels look, and how much of it each covers."""
    r = camera.rotation
    r00, r01, r02 = f4(r[0, 0]), f4(r[0, 1]), f4(r[0, 2])
    r10, r11, r12 = f4(r[1, 0]), f4(r[1, 1]), f4(r[1, 2])
    r20, r21, r22 = f4(r[2, 0]), f4(r[2, 1]), f4(r[2, 2])
    from_n, from_e, from_d = f4(camera.position[0]), f4(camera.position[1]), f4(camera.position[2])
    by_focal = f4(1.0 / camera.focal_px)
    for i in range(n):
        x, y, z = b.x[i], b.y[i], b.z[i]
        length = np.sqrt(x * x + y * y + ONE)
        by_length = ONE / length
        way_n, way_e, way_d = r00 * x + r01 * y + r02, r10 * x + r11 * y + r12, r20 * x + r21 * y + r22
        b.way_n[i], b.way_e[i], b.way_d[i] = way_n * by_length, way_e * by_length, way_d * by_length
        b.north[i], b.east[i], b.down[i] = from_n + way_n * z, from_e + way_e * z, from_d + way_d * z
        b.distance[i] = z * length
        b.footprint[i] = z * length * by_focal / np.sqrt(max(b.facing[i] * by_length, f4(0.02)))


@streamed
def scatter(b: Block, n: int, colour: U8) -> None:
    """Put finished pixels where they belong in a picture's bytes, one after another."""
    for i in range(n):
        at, packed = 3 * b.at[i], b.packed[i]
        colour[at] = np.uint8(packed & u4(255))
        colour[at + 1] = np.uint8((packed >> u4(8)) & u4(255))
        colour[at + 2] = np.uint8(packed >> u4(16))
