"""Smooth edges: where two surfaces meet between two pixels, their colours mix as far as each covers the other's pixel.

The nearer triangle's own edge, in the picture, says where between the pixels' centres it ends. Sides that run down the
picture mix left and right neighbours, the others those above and below.
"""

import numpy as np

from sitl_emu.world.render.kernel import F32, HALF, I32, U8, f4, i4, inlined, kernel
from sitl_emu.world.render.maps import LEAF
from sitl_emu.world.render.pixels import Picture
from sitl_emu.world.render.raster import NEAR_M, Buffers, Drawn, Meshes

SAME_COS = f4(0.96)
"""Triangles of one instance and material whose normals differ by less than 16 degrees have no edge between them."""


@inlined
def _are_leaves(seen: Buffers, meshes: Meshes, kinds: I32, one: int, other: int) -> bool:
    a, b = seen.triangle[one], seen.triangle[other]
    return bool(a >= 0 and b >= 0 and kinds[meshes.materials[a]] == LEAF and kinds[meshes.materials[b]] == LEAF)


@inlined
def _is_edge(seen: Buffers, meshes: Meshes, one: int, other: int) -> bool:
    a, b = seen.triangle[one], seen.triangle[other]
    if seen.slot[one] != seen.slot[other]:
        return not (a >= 0 and b >= 0 and meshes.materials[a] == 0 and meshes.materials[b] == 0)
    if a < 0 or b < 0:
        return False
    if meshes.materials[a] != meshes.materials[b]:
        return True
    n, m = meshes.normals[a], meshes.normals[b]
    return bool(n[0] * m[0] + n[1] * m[1] + n[2] * m[2] < SAME_COS)


@inlined
def _ends_at(
    seen: Buffers, drawn: Drawn, meshes: Meshes, at: int, x: float, y: float, is_across: bool, sign: float
) -> float:
    """Where the triangle of a pixel ends on the way to its neighbour, as a share of it; 1: not at a fitting edge."""
    slot = seen.slot[at]
    first = drawn.first_corner[slot]
    corners = meshes.triangles[seen.triangle[at]]
    p, q = drawn.projected, drawn.seen
    for k in range(3):
        if not q[first + corners[k], 2] > NEAR_M:
            return 1.0
    a, b, c = first + corners[0], first + corners[1], first + corners[2]
    area = (p[b, 0] - p[a, 0]) * (p[c, 1] - p[a, 1]) - (p[b, 1] - p[a, 1]) * (p[c, 0] - p[a, 0])
    inwards = 1.0 if area > 0.0 else -1.0
    nearest, fits = 1.0, False
    for k in range(3):
        i, j = first + corners[k], first + corners[(k + 1) % 3]
        run, rise = p[j, 0] - p[i, 0], p[j, 1] - p[i, 1]
        inside = inwards * (run * (y - p[i, 1]) - rise * (x - p[i, 0]))
        change = inwards * sign * (-rise if is_across else run)
        if change >= 0.0:
            continue
        share = inside / -change
        if share < nearest:
            nearest = max(share, 0.0)
            fits = abs(rise) >= abs(run) if is_across else abs(run) > abs(rise)
    return nearest if fits else 1.0


@inlined
def _mix(
    seen: Buffers, drawn: Drawn, meshes: Meshes, depth: F32, column: int, row: int, is_across: bool, width: int,
    source: U8, out: U8,
) -> None:  # fmt: skip
    """Mix a pixel with its right or its lower neighbour."""
    one = row * width + column
    other = one + 1 if is_across else one + width
    other_column, other_row = (column + 1, row) if is_across else (column, row + 1)
    is_first = depth[row, column] <= depth[other_row, other_column]
    if is_first:
        share = _ends_at(seen, drawn, meshes, one, column + 0.5, row + 0.5, is_across, 1.0)
    else:
        share = 1.0 - _ends_at(seen, drawn, meshes, other, other_column + 0.5, other_row + 0.5, is_across, -1.0)
    if not 0.0 < share < 1.0:
        return
    cover = f4(share) - HALF
    for k in range(3):
        a, b = f4(source[row, column, k]), f4(source[other_row, other_column, k])
        if cover < 0:
            mixed = f4(out[row, column, k]) + (b - a) * -cover
            out[row, column, k] = np.uint8(min(max(mixed + HALF, f4(0.0)), f4(255.0)))
        else:
            mixed = f4(out[other_row, other_column, k]) + (a - b) * cover
            out[other_row, other_column, k] = np.uint8(min(max(mixed + HALF, f4(0.0)), f4(255.0)))


@inlined
def _blend(one: int, other: int, source: U8, out: U8) -> None:
    """Take an eighth of each of two pixels to the other: leaves are too small and too many to ask for their edges."""
    for k in range(3):
        step = (i4(source[other, k]) - i4(source[one, k])) >> i4(3)
        out[one, k] = np.uint8(min(max(i4(out[one, k]) + step, i4(0)), i4(255)))
        out[other, k] = np.uint8(min(max(i4(out[other, k]) - step, i4(0)), i4(255)))


@kernel
def _smooth(seen: Buffers, drawn: Drawn, meshes: Meshes, kinds: I32, depth: F32, source: U8, out: U8) -> None:
    height, width = depth.shape
    source_row, out_row = source.reshape(-1, 3), out.reshape(-1, 3)
    for row in range(height):
        for column in range(width):
            at = row * width + column
            for is_across in (True, False):
                if column + 1 >= width if is_across else row + 1 >= height:
                    continue
                other = at + 1 if is_across else at + width
                is_same = seen.triangle[at] == seen.triangle[other] and seen.slot[at] == seen.slot[other]
                if is_same:
                    continue
                if _are_leaves(seen, meshes, kinds, at, other):
                    _blend(at, other, source_row, out_row)
                elif _is_edge(seen, meshes, at, other):
                    _mix(seen, drawn, meshes, depth, column, row, is_across, width, source, out)


def smoothed(seen: Buffers, drawn: Drawn, meshes: Meshes, kinds: I32, picture: Picture) -> U8:
    """The picture with smooth edges."""
    out = picture.colour.copy()
    _smooth(seen, drawn, meshes, kinds, picture.depth, picture.colour, out)
    return out
