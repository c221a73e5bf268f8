"""The ground: its relief, the colours of its map with detail close by, land beyond the map, and what fire leaves.

Water shows the ground, too; the same loops colour what lies under it.
"""

import numpy as np

from sitl_emu.world.render.burning import EMBERS_S
from sitl_emu.world.render.kernel import F32, HALF, ONE, ZERO, f4, i4, inlined, part, streamed, u4
from sitl_emu.world.render.maps import (
    BY_STEPS,
    SIXTEEN,
    FireMap,
    GroundMap,
    Relief,
    Surfaces,
    Textures,
    grey,
    level_of,
    mixed,
    texel,
)
from sitl_emu.world.render.pixels import Block
from sitl_emu.world.render.sky import fading

NOISE = i4(0)
"""The texture of even, cloudy noise."""
BY_BYTE = f4(1.0 / 255.0)
MEAN = f4(1.0 / 128.0)
"""One over what ground's detail textures have for 1."""
DETAIL_TO_M, FINE_TO_M = f4(0.12), f4(0.03)
"""Footprint of a pixel above which the ground's detail is too fine to be seen, at its two sizes."""
BY_EMBERS_S = f4(1.0 / EMBERS_S)
ROOT_HALF = f4(0.7071)
"""Two patterns together vary as one."""
FADES_1_M = f4(0.07)
"""How fast the ground's map gives way to far land before its border."""
SPAN = 128
"""Pixels in a row of which all are spared what none of them needs."""


@streamed
def find_height(b: Block, n: int, frame: F32, grid: F32, found: F32) -> None:
    """A grid of heights at each place: a column of `b`."""
    by_spacing = ONE / frame[2]
    last_row, last_column = f4(grid.shape[0] - 1) - f4(0.001), f4(grid.shape[1] - 1) - f4(0.001)
    for p in range(n):
        y = min(max((b.north[p] - frame[0]) * by_spacing, ZERO), last_row)
        x = min(max((b.east[p] - frame[1]) * by_spacing, ZERO), last_column)
        row, column = i4(y), i4(x)
        y -= f4(row)
        x -= f4(column)
        w3 = x * y
        i, j, k, m = u4(row), u4(row + 1), u4(column), u4(column + 1)
        low = grid[i, k] * (ONE - x - y + w3) + grid[i, m] * (x - w3)
        found[p] = low + grid[j, k] * (y - w3) + grid[j, m] * w3


@inlined
def _rises(slopes: np.uint32) -> tuple[np.float32, np.float32]:
    return f4(i4(slopes << SIXTEEN) >> i4(16)), f4(i4(slopes) >> i4(16))


@streamed
def slope(b: Block, n: int, relief: Relief) -> None:
    """The ground's normal."""
    frame, grid = relief.frame, relief.slopes
    by_spacing = ONE / frame[2]
    last_row, last_column = f4(grid.shape[0] - 1) - f4(0.001), f4(grid.shape[1] - 1) - f4(0.001)
    for p in range(n):
        y = min(max((b.north[p] - frame[0]) * by_spacing, ZERO), last_row)
        x = min(max((b.east[p] - frame[1]) * by_spacing, ZERO), last_column)
        row, column = i4(y), i4(x)
        y -= f4(row)
        x -= f4(column)
        w3 = x * y
        w0, w1, w2 = ONE - x - y + w3, x - w3, y - w3
        i, j, k, m = u4(row), u4(row + 1), u4(column), u4(column + 1)
        n0, e0 = _rises(grid[i, k])
        n1, e1 = _rises(grid[i, m])
        n2, e2 = _rises(grid[j, k])
        n3, e3 = _rises(grid[j, m])
        north = (n0 * w0 + n1 * w1 + n2 * w2 + n3 * w3) * BY_STEPS
        east = (e0 * w0 + e1 * w1 + e2 * w2 + e3 * w3) * BY_STEPS
        by_length = ONE / np.sqrt(ONE + north * north + east * east)
        b.normal_n[p], b.normal_e[p], b.normal_d[p] = -north * by_length, -east * by_length, -by_length


@streamed
def _find_colours(b: Block, n: int, ground: GroundMap) -> tuple[bool, bool]:
    """Colours of the map, and its detail's number; whether some pixels see land beyond it, and some see detail."""
    frame, texels = ground.frame, ground.texels
    by_gsd, levels = ONE / frame[2], i4(len(ground.starts))
    rows, columns = f4(ground.sizes[0, 0]), f4(ground.sizes[0, 1])
    beyond, detailed = i4(0), i4(0)
    for i in range(n):
        y, x = (b.north[i] - frame[0]) * by_gsd, (b.east[i] - frame[1]) * by_gsd
        inside = min(min(x, columns - x), min(y, rows - y)) * frame[2] * FADES_1_M
        share = min(max(inside, ZERO), ONE)
        level = min(level_of(b.footprint[i] * by_gsd * b.dither[i]), levels - i4(1))
        wide, high = ground.sizes[u4(level), 1], ground.sizes[u4(level), 0]
        shrink = ONE / f4(i4(1) << level)
        fx = min(max(x * shrink - HALF, ZERO), f4(wide) - f4(1.001))
        fy = min(max(y * shrink - HALF, ZERO), f4(high) - f4(1.001))
        column, row = i4(fx), i4(fy)
        at = i4(ground.starts[u4(level)] + row * wide + column)
        below = i4(at + wide)
        first = texels[u4(at)]
        r, g, blue, _ = mixed(
            first, texels[u4(at + 1)], texels[u4(below)], texels[u4(below + 1)], fx - f4(column), fy - f4(row)
        )
        b.red[i], b.green[i], b.blue[i], b.share[i] = r * BY_BYTE, g * BY_BYTE, blue * BY_BYTE, share
        layer = i4(first >> u4(24)) if level < 2 and b.footprint[i] < DETAIL_TO_M else i4(0)
        b.layer[i] = layer
        beyond |= i4(share < ONE)
        detailed |= layer
    return bool(beyond != 0), bool(detailed != 0)


@streamed
def _add_detail(b: Block, n: int, textures: Textures) -> bool:
    """Multiply by the pattern of what the ground is made of; whether some pixels see it finer still."""
    fine = i4(0)
    for i in range(n):
        layer = b.layer[i]
        level = level_of(b.footprint[i] * f4(512.0 / 2.3) * b.dither[i])
        r, g, blue, _ = texel(textures, layer, level, b.east[i] * f4(1 / 2.3), b.north[i] * f4(1 / 2.3))
        b.red[i] *= r * MEAN if layer > 0 else ONE
        b.green[i] *= g * MEAN if layer > 0 else ONE
        b.blue[i] *= blue * MEAN if layer > 0 else ONE
        fine |= i4(b.footprint[i] < FINE_TO_M)
    return bool(fine != 0)


@streamed
def _add_finer_detail(b: Block, n: int, textures: Textures) -> None:
    """The same pattern, smaller and turned, so that neither is seen to repeat."""
    for i in range(n):
        layer = b.layer[i] if b.footprint[i] < FINE_TO_M else i4(0)
        level = level_of(b.footprint[i] * f4(512.0 / 0.83) * b.dither[i])
        north, east = b.north[i], b.east[i]
        u = (east * f4(0.8) + north * f4(0.6)) * f4(1 / 0.83)
        v = (north * f4(0.8) - east * f4(0.6)) * f4(1 / 0.83)
        r, g, blue, _ = texel(textures, layer, level, u, v)
        b.red[i] *= HALF + HALF * r * MEAN if layer > 0 else ONE
        b.green[i] *= HALF + HALF * g * MEAN if layer > 0 else ONE
        b.blue[i] *= HALF + HALF * blue * MEAN if layer > 0 else ONE


@streamed
def _add_far_land(b: Block, n: int, ground: GroundMap, textures: Textures) -> None:
    """Where the map ends it gives way to land of its mean colour, with fields of light and dark."""
    frame = ground.frame
    for first in range(0, n, SPAN):
        count = min(n - first, SPAN)
        shares = b.share[first : first + count]
        least = ONE
        for i in range(count):
            least = min(least, shares[i])
        if least >= ONE:
            continue
        norths, easts, footprints = b.north[first:], b.east[first:], b.footprint[first:]
        reds, greens, blues = b.red[first:], b.green[first:], b.blue[first:]
        for i in range(count):
            north, east, share, footprint = norths[i], easts[i], shares[i], footprints[i]
            level = level_of(footprint * f4(512.0 / 90.0))
            near = grey(textures, NOISE, level, east * f4(1 / 90.0), north * f4(1 / 90.0))
            level = level_of(footprint * f4(512.0 / 700.0))
            far = grey(textures, NOISE, level, (east + north * f4(0.3)) * f4(1 / 700.0), north * f4(1 / 700.0))
            m = (f4(0.84) + near * f4(0.0006) + far * f4(0.0007)) * (ONE - share)
            reds[i] = reds[i] * share + frame[3] * m
            greens[i] = greens[i] * share + frame[4] * m
            blues[i] = blues[i] * share + frame[5] * m


@part
def colour_ground(b: Block, n: int, surfaces: Surfaces) -> None:
    """The ground's colour at each place."""
    beyond, detailed = _find_colours(b, n, surfaces.ground)
    if detailed and _add_detail(b, n, surfaces.textures):
        _add_finer_detail(b, n, surfaces.textures)
    if beyond:
        _add_far_land(b, n, surfaces.ground, surfaces.textures)


@streamed
def _char(b: Block, n: int, fire: FireMap, textures: Textures, time_s: np.float32) -> bool:
    """Of spans of which some pixel is near what burns or has burnt; whether there are any."""
    frame, grid, soonest = fire.frame, fire.grid, fire.soonest
    by_cell, rows, columns = ONE / frame[2], f4(grid.shape[0]), f4(grid.shape[1])
    some = False
    for first in range(0, n, SPAN):
        count = min(n - first, SPAN)
        norths, easts, footprints = b.north[first:], b.east[first:], b.footprint[first:]
        near = i4(0)
        for i in range(count):
            y, x = (norths[i] - frame[0]) * by_cell, (easts[i] - frame[1]) * by_cell
            inside = (y >= ZERO) & (x >= ZERO) & (y < rows) & (x < columns)
            row, column = i4(y if inside else ZERO), i4(x if inside else ZERO)
            near |= i4(inside & (soonest[u4(row), u4(column)] <= time_s))
        glows = b.glow[first:]
        if near == 0:
            glows[:count] = ZERO
            continue
        some = True
        reds, greens, blues = b.red[first:], b.green[first:], b.blue[first:]
        for i in range(count):
            north, east, footprint = norths[i], easts[i], footprints[i]
            # Two turned against each other, neither small enough to be seen to repeat
            level = level_of(footprint * f4(512.0 / 61.0))
            u = (east * f4(0.96) + north * f4(0.28)) * f4(1 / 61.0)
            v = (north * f4(0.96) - east * f4(0.28)) * f4(1 / 61.0)
            wild = texel(textures, NOISE, level, u, v)
            level = level_of(footprint * f4(512.0 / 5.3))
            u, v = (east * f4(0.8) + north * f4(0.6)) * f4(1 / 5.3), (north * f4(0.8) - east * f4(0.6)) * f4(1 / 5.3)
            fine = texel(textures, NOISE, level, u, v)
            # What glows and what is ash is of two such patterns, which together repeat nowhere
            level = level_of(footprint * f4(512.0 / 8.3))
            u = (east * f4(0.28) - north * f4(0.96)) * f4(1 / 8.3)
            v = (north * f4(0.28) + east * f4(0.96)) * f4(1 / 8.3)
            other = texel(textures, NOISE, level, u, v)
            # Borders are ragged: noise says how far away a pixel looks up when its place burns
            y = (north - frame[0] + (wild[1] + fine[1] - f4(256.0)) * f4(0.010)) * by_cell
            x = (east - frame[1] + (wild[2] + fine[2] - f4(256.0)) * f4(0.010)) * by_cell
            inside = (y >= ZERO) & (x >= ZERO) & (y < rows) & (x < columns)
            row, column = i4(y if inside else ZERO), i4(x if inside else ZERO)
            since, after = time_s - grid[u4(row), u4(column), 0], time_s - grid[u4(row), u4(column), 1]
            burns = inside & (since >= ZERO)
            char = min(f4(0.45) + since * f4(0.08), ONE) if burns else ZERO
            glowing = f4(128.0) + (fine[0] + other[1] - f4(256.0)) * ROOT_HALF
            heat = max(wild[0] * glowing * f4(1.0 / 16384.0) - f4(1.5), ZERO) * f4(1.3)
            heat = heat * heat * (ONE if after < ZERO else fading(after * BY_EMBERS_S) * f4(0.35))
            ashen = f4(128.0) + (fine[3] + other[2] - f4(256.0)) * ROOT_HALF
            ash = f4(0.03) + max(wild[3] * ashen, ZERO) * f4(0.11 / 16384.0)
            glows[i] = heat if burns else ZERO
            # What is left is a little of its pattern, on soot
            reds[i] += (ash - f4(0.90) * reds[i]) * char
            greens[i] += (ash - f4(0.91) * greens[i]) * char
            blues[i] += (ash - f4(0.91) * blues[i]) * char
    return some


@part
def burn_ground(b: Block, n: int, surfaces: Surfaces, time_s: np.float32) -> bool:
    """Char the ground where it has burnt, and let embers glow; whether any may."""
    return surfaces.fire.grid.shape[0] > 1 and _char(b, n, surfaces.fire, surfaces.textures, time_s)
