"""What is looked up when a pixel is shaded: textures, the ground's colours, its relief, and where the sun reaches."""

from typing import NamedTuple

import numpy as np

from sitl_emu.world.render.kernel import F32, F64, HALF, I32, ONE, U32, ZERO, f4, i4, inlined, kernel, u4
from sitl_emu.world.render.raster import NOTHING, Buffers, Instances, Meshes, fill

SIDE_LOG2 = 9
SIDE = 1 << SIDE_LOG2
"""Texels along each side of a texture."""
LEVELS = 8
"""Of a texture: from 512 texels to 4."""

GROUND, TEXTURED, WATER, LEAF = 0, 1, 2, 3
"""Kinds of material."""


STEPS = 2048.0
BY_STEPS = f4(1.0 / STEPS)
"""Of a slope: 0.03 degrees on level ground."""

EVEN, LOW, EIGHT, SIXTEEN = u4(0x00FF00FF), u4(0xFFFF), u4(8), u4(16)
BY_256 = f4(1.0 / 256.0)


class Textures(NamedTuple):
    """Square textures that repeat, red, green, blue and how much of a tint they take, each half as large in turn."""

    texels: U32
    """A byte for each, red the lowest."""
    starts: I32
    """(LEVELS,): where a level of the first texture begins."""


class Materials(NamedTuple):
    """What surfaces are made of."""

    kind: I32
    layer: I32
    """The texture's number."""
    gloss: F32
    """How much it mirrors the sky where it takes no tint."""


class GroundMap(NamedTuple):
    """The ground's colours and the number of its detail texture, from its south-west corner, and coarser."""

    texels: U32
    starts: I32
    sizes: I32
    """(levels, 2): rows, columns."""
    frame: F32
    """North and east of its corner, metres a texel, and the colour of land beyond it."""


class Relief(NamedTuple):
    """The ground, bilinear; each grid (rows, columns)."""

    height: F32
    shut: F32
    """Up to what height its sky is shut."""
    slopes: U32
    """Its rise to north (the lower half) and to east, whole numbers with a sign, in steps of BY_STEPS."""
    frame: F32
    """North and east of the first, spacing."""


class FireMap(NamedTuple):
    """When each cell of the ground burns, s; 1 x 1: there is no fire."""

    grid: F32
    """(rows, columns, 2): when it begins, and when it has burnt out."""
    soonest: F32
    """(rows, columns): when the first one near it begins."""
    frame: F32
    """North and east of its corner, metres a cell."""


class SunMap(NamedTuple):
    """How far towards the sun the first thing lies, seen from the sun."""

    nearness: F32
    """(side * side,); larger is nearer to the sun."""
    side: int
    frame: F32
    """Its middle (3,), then right (3,), down (3,), towards the sun (3,), metres a texel."""


class Surfaces(NamedTuple):
    """All that is looked up."""

    textures: Textures
    materials: Materials
    ground: GroundMap
    relief: Relief
    fire: FireMap
    sun: SunMap
    moving_sun: SunMap
    """The same of what moves, about the place that is looked at; `side` 0: nothing does."""
    lamps: F32
    """(n, 4): what lights besides (firelight.py)."""


@inlined
def level_of(footprint: np.float32) -> np.int32:
    """The level of a texture for a pixel that covers `footprint` texels of the finest."""
    level = i4(footprint > f4(1.414)) + i4(footprint > f4(2.828)) + i4(footprint > f4(5.657))
    level += i4(footprint > f4(11.31)) + i4(footprint > f4(22.63)) + i4(footprint > f4(45.25))
    return i4(level + i4(footprint > f4(90.5)))


@inlined
def mixed(
    t0: np.uint32, t1: np.uint32, t2: np.uint32, t3: np.uint32, part_x: np.float32, part_y: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Four texels, two above and two below, mixed: bytes two by two in integers, a quarter of the time of floats."""
    x, y = u4(i4(part_x * f4(256.0))), u4(i4(part_y * f4(256.0)))
    w3 = u4(u4(x * y) >> EIGHT)
    w1, w2 = u4(x - w3), u4(y - w3)
    w0 = u4(u4(256) - w1 - w2 - w3)
    even = u4(u4((t0 & EVEN) * w0) + u4((t1 & EVEN) * w1) + u4((t2 & EVEN) * w2) + u4((t3 & EVEN) * w3))
    odd = u4(u4(((t0 >> EIGHT) & EVEN) * w0) + u4(((t1 >> EIGHT) & EVEN) * w1))
    odd = u4(odd + u4(((t2 >> EIGHT) & EVEN) * w2) + u4(((t3 >> EIGHT) & EVEN) * w3))
    return (
        f4(i4(even & LOW)) * BY_256,
        f4(i4(odd & LOW)) * BY_256,
        f4(i4(even >> SIXTEEN)) * BY_256,
        f4(i4(odd >> SIXTEEN)) * BY_256,
    )


@inlined
def texel(
    textures: Textures, layer: np.int32, level: np.int32, u: np.float32, v: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Red, green, blue and tint of a texture, 0 to 255, at a place in repeats."""
    log2 = i4(SIDE_LOG2 - level)
    side = i4(i4(1) << log2)
    mask = i4(side - i4(1))
    x, y = u * f4(side) - HALF, v * f4(side) - HALF
    floor_x, floor_y = np.floor(x), np.floor(y)
    column, row = i4(floor_x), i4(floor_y)
    base = i4(textures.starts[u4(level)] + (layer << i4(log2 + log2)))
    left, right = i4(column & mask), i4(i4(column + 1) & mask)
    top, bottom = i4(base + (i4(row & mask) << log2)), i4(base + (i4(i4(row + 1) & mask) << log2))
    t = textures.texels
    return mixed(
        t[u4(top + left)], t[u4(top + right)], t[u4(bottom + left)], t[u4(bottom + right)], x - floor_x, y - floor_y
    )


@inlined
def grey(textures: Textures, layer: np.int32, level: np.int32, u: np.float32, v: np.float32) -> np.float32:
    """The red of a texture, 0 to 255."""
    return texel(textures, layer, level, u, v)[0]


@inlined
def sunlit(sun: SunMap, north: np.float32, east: np.float32, down: np.float32, leeway: np.float32) -> np.float32:
    """The share of the sun that reaches a place: 0 in shadow; what lies less than `leeway` before it casts none."""
    frame, side, map_ = sun.frame, i4(sun.side), sun.nearness
    n, e, d = north - frame[0], east - frame[1], down - frame[2]
    by_texel, middle, last = ONE / frame[12], f4(side) * HALF - HALF, f4(side - i4(1)) - f4(0.001)
    x = (n * frame[3] + e * frame[4] + d * frame[5]) * by_texel + middle
    y = (n * frame[6] + e * frame[7] + d * frame[8]) * by_texel + middle
    in_x, in_y = min(max(x, ZERO), last), min(max(y, ZERO), last)
    is_outside = (in_x != x) | (in_y != y)
    near = n * frame[9] + e * frame[10] + d * frame[11] + leeway + SUN_OFFSET
    column, row = i4(in_x), i4(in_y)
    in_x -= f4(column)
    in_y -= f4(row)
    at = i4(row * side + column)
    below = i4(at + side)
    w3 = in_x * in_y
    w1, w2 = in_x - w3, in_y - w3
    light = ONE - w1 - w2 - w3 if map_[u4(at)] < near else ZERO
    light += w1 if map_[u4(at + 1)] < near else ZERO
    light += w2 if map_[u4(below)] < near else ZERO
    light += w3 if map_[u4(below + 1)] < near else ZERO
    return ONE if is_outside else light


SUN_OFFSET = f4(4096.0)
"""Added to distances towards the sun, so that all of them are above 0, which is an empty map's."""


@kernel
def draw_sun_map(
    meshes: Meshes, things: Instances, which: I32, level_of_each: I32, sun: SunMap, out: Buffers, p: F64
) -> None:
    """Draw instances, as the sun sees them, into a map that was cleared: `out.nearness` is `sun.nearness`.

    `p` (corners, 3) is used: as large as the largest of the levels.
    """
    from_, side = sun.frame, sun.side
    for k in range(len(which)):
        i = which[k]
        level = level_of_each[i]
        turn, place = things.rotation[i], things.place[i]
        first = meshes.levels[level, 0]
        for c in range(meshes.levels[level, 1] - first):
            v = meshes.corners[first + c]
            n = turn[0, 0] * v[0] + turn[0, 1] * v[1] + turn[0, 2] * v[2] + place[0] - from_[0]
            e = turn[1, 0] * v[0] + turn[1, 1] * v[1] + turn[1, 2] * v[2] + place[1] - from_[1]
            d = turn[2, 0] * v[0] + turn[2, 1] * v[1] + turn[2, 2] * v[2] + place[2] - from_[2]
            p[c, 0] = (n * from_[3] + e * from_[4] + d * from_[5]) / from_[12] + 0.5 * side
            p[c, 1] = (n * from_[6] + e * from_[7] + d * from_[8]) / from_[12] + 0.5 * side
            p[c, 2] = n * from_[9] + e * from_[10] + d * from_[11] + SUN_OFFSET
        for number in range(meshes.levels[level, 2], meshes.levels[level, 3]):
            a, b, c = meshes.triangles[number]
            fill(
                p[a, 0], p[a, 1], p[a, 2], p[b, 0], p[b, 1], p[b, 2], p[c, 0], p[c, 1], p[c, 2],
                False, i4(NOTHING), 0, side, side, out,
            )  # fmt: skip
