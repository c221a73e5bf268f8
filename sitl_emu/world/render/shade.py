"""One pass over a picture's pixels: what each sees, how far away, and how it is lit."""

from typing import NamedTuple

import numpy as np

from sitl_emu.world.render.kernel import F32, HALF, I32, ONE, U8, ZERO, f4, inlined, kernel
from sitl_emu.world.render.maps import (
    GROUND,
    LEAF,
    WATER,
    FireMap,
    GroundMap,
    Materials,
    Relief,
    SunMap,
    Textures,
    grey,
    level_of,
    mixed,
    relief_at,
    sunlit,
    texel,
)
from sitl_emu.world.render.raster import Buffers, Drawn, Instances, Meshes, Pinhole
from sitl_emu.world.render.sky import Air, clouded_sky, developed, fading, sky_light

NOISE = 0
"""The texture of even, cloudy noise."""
BY_BYTE = f4(1.0 / 255.0)
ONE_ON = np.uint64(1)
DETAIL_TO_M, FINE_TO_M = f4(0.12), f4(0.03)
"""Footprint of a pixel above which the ground's detail is too fine to be seen, at its two sizes."""
MEAN = f4(1.0 / 128.0)


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


class Picture(NamedTuple):
    """What is made."""

    colour: U8
    """(height, width, 3), blue, green, red."""
    depth: F32
    """(height, width) along the optical axis, m; inf for the sky."""
    objects: I32
    """(height, width): the object's number; -1 for the sky."""


@inlined
def detail_of(packed: np.uint32) -> int:
    """The number of the detail texture in a texel of the ground map."""
    return int(np.int64(packed >> np.uint32(24)))


@inlined
def ground_colour(
    surfaces: Surfaces, north: np.float32, east: np.float32, footprint: np.float32, dither: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """Red, green, blue of the ground, from 0 to 1."""
    ground, textures = surfaces.ground, surfaces.textures
    frame = ground.frame
    y, x = (north - frame[0]) / frame[2], (east - frame[1]) / frame[2]
    rows, columns = ground.sizes[0, 0], ground.sizes[0, 1]
    # Where the map ends it gives way to land of its mean colour, with fields of light and dark.
    inside = min(min(x, f4(columns) - x), min(y, f4(rows) - y)) * frame[2] * f4(0.07)
    share = min(max(inside, ZERO), ONE)
    r, g, b = ZERO, ZERO, ZERO
    if share > ZERO:
        level = level_of(footprint / frame[2] * dither, len(ground.starts))
        rows_here, columns_here = ground.sizes[level, 0], ground.sizes[level, 1]
        shrink = ONE / f4(1 << level)
        fx = min(max(x * shrink - HALF, ZERO), f4(columns_here) - f4(1.001))
        fy = min(max(y * shrink - HALF, ZERO), f4(rows_here) - f4(1.001))
        column, row = np.int64(fx), np.int64(fy)
        at = np.uint64(ground.starts[level] + row * columns_here + column)
        below = at + np.uint64(columns_here)
        r, g, b, _ = mixed(ground.texels, at, at + ONE_ON, below, below + ONE_ON, fx - f4(column), fy - f4(row))
        r, g, b = r * BY_BYTE, g * BY_BYTE, b * BY_BYTE
        if footprint < DETAIL_TO_M:
            layer = detail_of(ground.texels[at]) if level < 2 else 0
            if layer > 0:
                texels = footprint * f4(512.0 / 2.3) * dither
                d = texel(textures, layer, level_of(texels, 8), east * f4(1 / 2.3), north * f4(1 / 2.3))
                r *= d[0] * MEAN
                g *= d[1] * MEAN
                b *= d[2] * MEAN
                u, v = (
                    (east * f4(0.8) + north * f4(0.6)) * f4(1 / 0.83),
                    (north * f4(0.8) - east * f4(0.6)) * f4(1 / 0.83),
                )
                if footprint < FINE_TO_M:
                    e = texel(textures, layer, level_of(texels * f4(2.3 / 0.83), 8), u, v)
                    r *= HALF + HALF * e[0] * MEAN
                    g *= HALF + HALF * e[1] * MEAN
                    b *= HALF + HALF * e[2] * MEAN
    if share < ONE:
        level = level_of(footprint * f4(512.0 / 90.0), 8)
        near = grey(textures, NOISE, level, east * f4(1 / 90.0), north * f4(1 / 90.0))
        level = level_of(footprint * f4(512.0 / 700.0), 8)
        far = grey(textures, NOISE, level, (east + north * f4(0.3)) * f4(1 / 700.0), north * f4(1 / 700.0))
        m = (f4(0.84) + near * f4(0.0006) + far * f4(0.0007)) * (ONE - share)
        r = r * share + frame[3] * m
        g = g * share + frame[4] * m
        b = b * share + frame[5] * m
    return r, g, b


@inlined
def embers(
    surfaces: Surfaces, air: Air, north: np.float32, east: np.float32, footprint: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """How far the ground is charred, 0 to 1, how much it glows, and how grey its ashes are."""
    grid, frame = surfaces.fire.grid, surfaces.fire.frame
    if grid.shape[0] < 2:
        return ZERO, ZERO, ZERO
    row, column = np.int64((north - frame[0]) / frame[2]), np.int64((east - frame[1]) / frame[2])
    inside = 0 <= row < grid.shape[0] and 0 <= column < grid.shape[1]
    if not inside or grid[row, column, 2] > f4(air.time_s):
        return ZERO, ZERO, ZERO
    level = level_of(footprint * f4(512.0 / 19.0), 8)
    wild = texel(surfaces.textures, NOISE, level, east * f4(1 / 19.0), north * f4(1 / 19.0))
    level = level_of(footprint * f4(512.0 / 1.7), 8)
    u, v = (east * f4(0.8) + north * f4(0.6)) * f4(1 / 1.7), (north * f4(0.8) - east * f4(0.6)) * f4(1 / 1.7)
    fine = texel(surfaces.textures, NOISE, level, u, v)
    row = np.int64(np.floor((north - frame[0] + (wild[1] + fine[1] - f4(256.0)) * f4(0.010)) / frame[2]))
    column = np.int64(np.floor((east - frame[1] + (wild[2] + fine[2] - f4(256.0)) * f4(0.010)) / frame[2]))
    if row < 0 or column < 0 or row >= grid.shape[0] or column >= grid.shape[1]:
        return ZERO, ZERO, ZERO
    since, after = f4(air.time_s) - grid[row, column, 0], f4(air.time_s) - grid[row, column, 1]
    if since < ZERO:
        return ZERO, ZERO, ZERO
    char = min(f4(0.45) + since * f4(0.08), ONE)
    heat = max(wild[0] * fine[0] * f4(1.0 / 16384.0) - f4(1.5), ZERO) * f4(1.3)
    heat = heat * heat * (ONE if after < ZERO else fading(after * f4(1.0 / 45.0)) * f4(0.35))
    return char, heat, f4(0.03) + wild[3] * fine[3] * f4(0.11 / 16384.0)


@inlined
def ripples(
    surfaces: Surfaces, air: Air, north: np.float32, east: np.float32, footprint: np.float32
) -> tuple[np.float32, np.float32]:
    """How water's surface rises to north and to east: two patterns that drift apart."""
    textures, t = surfaces.textures, f4(air.time_s)
    level = level_of(footprint * f4(512.0 / 6.0), 8)
    u, v = east * f4(1 / 6.0) + t * f4(0.021), north * f4(1 / 6.0) + t * f4(0.013)
    step = f4(1.0 / 512.0) * f4(1 << level)
    here = grey(textures, NOISE, level, u, v)
    rise_e = grey(textures, NOISE, level, u + step, v) - here
    rise_n = grey(textures, NOISE, level, u, v + step) - here
    u, v = east * f4(1 / 2.1) - t * f4(0.043) + north * f4(0.11), north * f4(1 / 2.1) + t * f4(0.031)
    level = level_of(footprint * f4(512.0 / 2.1), 8)
    step = f4(1.0 / 512.0) * f4(1 << level)
    here = grey(textures, NOISE, level, u, v)
    rise_e += grey(textures, NOISE, level, u + step, v) - here
    rise_n += grey(textures, NOISE, level, u, v + step) - here
    calm = f4(0.0024) / (ONE + footprint * f4(6.0))
    return rise_n * calm, rise_e * calm


@kernel
def water_light(
    surfaces: Surfaces, air: Air, place: F32, ray: F32, footprint: np.float32, dither: np.float32, sun: np.float32,
    tint: F32, murk_1_m: np.float32, out: F32,
) -> None:  # fmt: skip
    """Light from water into `out`: the bottom through its murk, the sky by the angle of view, the sun's glint."""
    rise_n, rise_e = ripples(surfaces, air, place[0], place[1], footprint)
    height, _, _, shut = relief_at(surfaces.relief, place[0], place[1])
    level = -place[2]
    slant = max(-ray[0] * rise_n - ray[1] * rise_e + ray[2], f4(0.02))
    # Light goes down and up again
    murk = ONE - fading(max(level - height, ZERO) * TWICE * murk_1_m)
    miss = ONE - min(slant, ONE)
    mirror = miss * miss
    mirror = f4(0.025) + f4(0.975) * mirror * mirror * miss
    n, e, u = ray[0] + TWICE * slant * rise_n, ray[1] + TWICE * slant * rise_e, -ray[2] + TWICE * slant
    length = ONE / np.sqrt(n * n + e * e + u * u)
    n, e, u = n * length, e * length, max(u * length, f4(0.01))
    sky = sky_light(air, n, e, u)
    open_ = ONE / (ONE + f4(0.12) * max(shut - level, ZERO))
    bottom = ground_colour(surfaces, place[0] + rise_n, place[1] + rise_e, footprint, dither)
    rows = air.rows
    towards = n * rows[0, 0] + e * rows[0, 1] - u * rows[0, 2]
    glint = max(towards - f4(0.96), ZERO) * f4(25.0)
    glint = glint * glint
    glint = glint * glint * f4(1.3) * sun
    for k in range(3):
        lit = rows[1, k] * sun * max(-rows[0, 2], ZERO) + rows[2, k] * open_
        body = (tint[k] * tint[k]) * murk + bottom[k] * bottom[k] * HALF * (ONE - murk)
        out[k] = (
            body * lit * (ONE - mirror)
            + (sky[k] * (HALF + HALF * open_)) * mirror
            + rows[1, k] * glint * mirror * f4(6.0)
        )


TWICE = f4(2.0)


@inlined
def plane_of(drawn: Drawn, meshes: Meshes, things: Instances, slot: int, number: int, p: F32) -> None:
    """The plane of a triangle, and how its texture lies, into `p`: see PLANE."""
    at = drawn.first_corner[slot]
    first = meshes.levels[drawn.level[slot], 0]
    ia, ib, ic = meshes.triangles[number]
    a, b, c = drawn.seen[at + ia], drawn.seen[at + ib], drawn.seen[at + ic]
    e1x, e1y, e1z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    e2x, e2y, e2z = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
    square = nx * nx + ny * ny + nz * nz
    by_square = ONE / max(square, f4(1e-24))
    p[0], p[1], p[2] = nx, ny, nz
    p[3] = nx * a[0] + ny * a[1] + nz * a[2]
    p[4] = np.sqrt(by_square)
    uv_a, uv_b, uv_c = meshes.uv[first + ia], meshes.uv[first + ib], meshes.uv[first + ic]
    b1x, b1y, b1z = (
        (e2y * nz - e2z * ny) * by_square,
        (e2z * nx - e2x * nz) * by_square,
        (e2x * ny - e2y * nx) * by_square,
    )
    b2x, b2y, b2z = (
        (ny * e1z - nz * e1y) * by_square,
        (nz * e1x - nx * e1z) * by_square,
        (nx * e1y - ny * e1x) * by_square,
    )
    for k in range(2):
        d1, d2 = uv_b[k] - uv_a[k], uv_c[k] - uv_a[k]
        ux, uy, uz = b1x * d1 + b2x * d2, b1y * d1 + b2y * d2, b1z * d1 + b2z * d2
        p[5 + 4 * k], p[6 + 4 * k], p[7 + 4 * k] = ux, uy, uz
        p[8 + 4 * k] = uv_a[k] - (ux * a[0] + uy * a[1] + uz * a[2])
    p[13] = np.sqrt(max(p[5] * p[5] + p[6] * p[6] + p[7] * p[7], p[9] * p[9] + p[10] * p[10] + p[11] * p[11]))
    i = drawn.instance[slot]
    turn, n = things.rotation[i], meshes.normals[number]
    for k in range(3):
        p[14 + k] = turn[k, 0] * n[0] + turn[k, 1] * n[1] + turn[k, 2] * n[2]
        p[17 + k] = meshes.tints[number, k] * things.tint[i, k]


PLANE = 20
"""Figures of a triangle: normal (0-2, camera axes) and its product with a corner (3), 1 / the normal's length (4), how
u (5-8) and v (9-12) follow from a point, repeats a metre (13), the light's normal (14-16, NED), tint (17-19)."""


@kernel
def shade(
    seen: Buffers, drawn: Drawn, meshes: Meshes, things: Instances, surfaces: Surfaces, camera: Pinhole, air: Air,
    out: Picture, scratch: F32,
) -> None:  # fmt: skip
    """Fill the picture; `scratch` (4, PLANE) is used."""
    width, height = camera.width, camera.height
    r = camera.rotation
    r00, r01, r02 = f4(r[0, 0]), f4(r[0, 1]), f4(r[0, 2])
    r10, r11, r12 = f4(r[1, 0]), f4(r[1, 1]), f4(r[1, 2])
    r20, r21, r22 = f4(r[2, 0]), f4(r[2, 1]), f4(r[2, 2])
    from_n, from_e, from_d = f4(camera.position[0]), f4(camera.position[1]), f4(camera.position[2])
    by_focal, exposure, haze = f4(1.0 / camera.focal_px), f4(air.exposure), f4(air.haze)
    middle_x, middle_y = f4(width) * HALF, f4(height) * HALF
    rows = air.rows
    sun_n, sun_e, sun_d = rows[0, 0], rows[0, 1], rows[0, 2]
    direct, above, below, horizon = rows[1], rows[2], rows[3], rows[4]
    last_triangle, last_slot = -2, -2
    p, place, ray, light = scratch[0], scratch[1], scratch[2], scratch[3]
    kind, layer, gloss, object_ = 0, 0, ZERO, -1
    for row in range(height):
        y = (f4(row) + HALF - middle_y) * by_focal
        for column in range(width):
            at = row * width + column
            x = (f4(column) + HALF - middle_x) * by_focal
            by_length = ONE / np.sqrt(x * x + y * y + ONE)
            way_n, way_e, way_d = r00 * x + r01 * y + r02, r10 * x + r11 * y + r12, r20 * x + r21 * y + r22
            number, slot = seen.triangle[at], seen.slot[at]
            if number < 0:
                sky = clouded_sky(air, surfaces.textures, way_n * by_length, way_e * by_length, -way_d * by_length)
                out.colour[row, column, 0] = developed(sky[2] * exposure)
                out.colour[row, column, 1] = developed(sky[1] * exposure)
                out.colour[row, column, 2] = developed(sky[0] * exposure)
                out.depth[row, column], out.objects[row, column] = np.inf, -1
                continue
            if number != last_triangle or slot != last_slot:
                last_triangle, last_slot = number, slot
                plane_of(drawn, meshes, things, slot, number, p)
                material = meshes.materials[number]
                kind, layer = surfaces.materials.kind[material], surfaces.materials.layer[material]
                gloss, object_ = surfaces.materials.gloss[material], things.objects[drawn.instance[slot]]
            along = p[0] * x + p[1] * y + p[2]
            z = p[3] / along
            out.depth[row, column], out.objects[row, column] = z, object_
            place[0], place[1], place[2] = from_n + way_n * z, from_e + way_e * z, from_d + way_d * z
            distance = z / by_length
            facing = abs(along) * p[4] * by_length
            # Metres a pixel covers: between its short and its long side
            footprint = distance * by_focal / np.sqrt(max(facing, f4(0.02)))
            dither = f4(0.85) + f4(0.1) * f4(((row & 1) << 1) | (column & 1))
            n, e, d = p[14], p[15], p[16]
            _, rise_n, rise_e, shut = relief_at(surfaces.relief, place[0], place[1])
            mirror, glow = ZERO, ZERO
            if kind == GROUND:
                red, green, blue = ground_colour(surfaces, place[0], place[1], footprint, dither)
                char, glow, ash = embers(surfaces, air, place[0], place[1], footprint)
                if char > ZERO:
                    # What is left is a little of its pattern, on soot
                    red, green, blue = (
                        red + (ash + f4(0.10) * red - red) * char,
                        green + (ash + f4(0.09) * green - green) * char,
                        blue + (ash + f4(0.09) * blue - blue) * char,
                    )
                by_n = ONE / np.sqrt(ONE + rise_n * rise_n + rise_e * rise_e)
                n, e, d = -rise_n * by_n, -rise_e * by_n, -by_n
            elif kind == WATER:
                red, green, blue = ZERO, ZERO, ZERO
            else:
                hx, hy = x * z, y * z
                u = p[5] * hx + p[6] * hy + p[7] * z + p[8]
                v = p[9] * hx + p[10] * hy + p[11] * z + p[12]
                red, green, blue, takes = texel(
                    surfaces.textures, layer, level_of(footprint * p[13] * f4(512.0) * dither, 8), u, v
                )
                takes *= BY_BYTE
                red *= BY_BYTE * (ONE + (p[17] - ONE) * takes)
                green *= BY_BYTE * (ONE + (p[18] - ONE) * takes)
                blue *= BY_BYTE * (ONE + (p[19] - ONE) * takes)
                mirror = gloss * (ONE - takes)
                if n * way_n + e * way_e + d * way_d > ZERO and kind != LEAF:
                    n, e, d = -n, -e, -d
            lambert = n * sun_n + e * sun_e + d * sun_d
            if kind == LEAF:
                lambert = f4(0.25) + f4(0.75) * lambert
            sun = ZERO
            if lambert > ZERO:
                texel_m = surfaces.sun.frame[12]
                off = texel_m * f4(1.2)
                sun = sunlit(surfaces.sun, place[0] + n * off, place[1] + e * off, place[2] + d * off, texel_m)
                if sun > ZERO and surfaces.moving_sun.side > 0:
                    off = surfaces.moving_sun.frame[12]
                    sun *= sunlit(
                        surfaces.moving_sun, place[0] + n * off, place[1] + e * off, place[2] + d * off, off * HALF
                    )

            open_ = ONE / (ONE + f4(0.16) * max(shut + place[2], ZERO))
            if kind == WATER:
                ray[0], ray[1], ray[2] = way_n * by_length, way_e * by_length, way_d * by_length
                water_light(surfaces, air, place, ray, footprint, dither, sun, p[17:20], p[8], light)
            else:
                sun *= lambert
                up = HALF - HALF * d
                light[0] = red * red * (direct[0] * sun + (above[0] * up + below[0] * (ONE - up)) * open_)
                light[1] = green * green * (direct[1] * sun + (above[1] * up + below[1] * (ONE - up)) * open_)
                light[2] = blue * blue * (direct[2] * sun + (above[2] * up + below[2] * (ONE - up)) * open_)
                if glow > ZERO:
                    light[0] += glow * f4(0.95)
                    light[1] += glow * glow * f4(0.30)
                    light[2] += glow * glow * f4(0.04)
                if mirror > ZERO:
                    along = TWICE * (way_n * n + way_e * e + way_d * d) * by_length
                    sky = sky_light(
                        air, way_n * by_length - along * n, way_e * by_length - along * e, along * d - way_d * by_length
                    )
                    miss = ONE + HALF * along
                    mirror *= f4(0.08) + f4(0.92) * miss * miss * miss * miss
                    mirror *= open_
                    light[0] += (sky[0] - light[0]) * mirror
                    light[1] += (sky[1] - light[1]) * mirror
                    light[2] += (sky[2] - light[2]) * mirror
            clear = fading(distance * haze)
            veil = (ONE - clear) * exposure
            clear *= exposure
            out.colour[row, column, 0] = developed(light[2] * clear + horizon[2] * veil)
            out.colour[row, column, 1] = developed(light[1] * clear + horizon[1] * veil)
            out.colour[row, column, 2] = developed(light[0] * clear + horizon[0] * veil)
