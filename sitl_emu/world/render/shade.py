"""A picture's pixels, some rows at a time: what each sees, how far away, and how it is lit."""

import numpy as np

from sitl_emu.world.render.firelight import add_firelight, find_firelight
from sitl_emu.world.render.kernel import HALF, ONE, TWO, U8, ZERO, f4, i4, kernel, part, streamed, u4
from sitl_emu.world.render.land import BY_BYTE, burn_ground, colour_ground, find_height, slope
from sitl_emu.world.render.maps import SunMap, Surfaces, Textures, level_of, sunlit, texel
from sitl_emu.world.render.pixels import ABOUT, KINDS, Block, Memory, Picture, find_places, from_, scatter, sort_pixels
from sitl_emu.world.render.raster import Buffers, Drawn, Instances, Meshes, Pinhole
from sitl_emu.world.render.sky import Air, clouded_sky, developed, fading, sky_light
from sitl_emu.world.render.water import light_water


@streamed
def _colour_meshes(b: Block, n: int, textures: Textures) -> bool:
    """Colours and normals of what stands, as it is seen; whether some of it mirrors."""
    mirrors = i4(0)
    for i in range(n):
        # Of what is seen nearly edge on, a pixel covers so much that what repeats there would be beaten to dots
        grazing = max(f4(0.0625) / (b.facing[i] * b.facing[i] + f4(1e-6)), ONE)
        level = level_of(b.footprint[i] * np.sqrt(np.sqrt(grazing)) * b.repeats[i] * f4(512.0) * b.dither[i])
        red, green, blue, takes = texel(textures, b.layer[i], level, b.u[i], b.v[i])
        takes *= BY_BYTE
        b.red[i] = red * BY_BYTE * (ONE + (b.tint_r[i] - ONE) * takes)
        b.green[i] = green * BY_BYTE * (ONE + (b.tint_g[i] - ONE) * takes)
        b.blue[i] = blue * BY_BYTE * (ONE + (b.tint_b[i] - ONE) * takes)
        mirror = b.mirror[i] * (ONE - takes)
        b.mirror[i] = mirror
        mirrors |= i4(mirror > ZERO)
        # The side that is seen is the one that is lit; leaves have but one, that of the crown
        n_, e_, d_ = b.normal_n[i], b.normal_e[i], b.normal_d[i]
        away = n_ * b.way_n[i] + e_ * b.way_e[i] + d_ * b.way_d[i]
        side = -ONE if (away > ZERO) & (b.is_leaf[i] == 0) else ONE
        b.normal_n[i], b.normal_e[i], b.normal_d[i] = n_ * side, e_ * side, d_ * side
    return bool(mirrors != 0)


@streamed
def _find_sun(b: Block, n: int, sun: SunMap, air: Air) -> None:
    """How far pixels look towards the sun, and whether it reaches them."""
    sun_n, sun_e, sun_d = air.rows[0, 0], air.rows[0, 1], air.rows[0, 2]
    texel_m = sun.frame[12]
    off = texel_m * f4(1.2)
    for i in range(n):
        n_, e_, d_ = b.normal_n[i], b.normal_e[i], b.normal_d[i]
        lambert = n_ * sun_n + e_ * sun_e + d_ * sun_d
        lambert = f4(0.25) + f4(0.75) * lambert if b.is_leaf[i] != 0 else lambert
        lit = sunlit(sun, b.north[i] + n_ * off, b.east[i] + e_ * off, b.down[i] + d_ * off, texel_m)
        b.lambert[i], b.sun[i] = max(lambert, ZERO), lit if lambert > ZERO else ZERO


@streamed
def _find_moving_shadows(b: Block, n: int, sun: SunMap) -> None:
    off = sun.frame[12]
    for i in range(n):
        north, east, down = (
            b.north[i] + b.normal_n[i] * off,
            b.east[i] + b.normal_e[i] * off,
            b.down[i] + b.normal_d[i] * off,
        )
        b.sun[i] *= sunlit(sun, north, east, down, off * HALF)


@streamed
def _light_land(b: Block, n: int, air: Air) -> None:
    """From a surface's own colour to its light: sun, sky, and what the land around reflects."""
    direct, above, below = air.rows[1], air.rows[2], air.rows[3]
    for i in range(n):
        sun = b.sun[i] * b.lambert[i]
        open_ = ONE / (ONE + f4(0.16) * max(b.open[i] + b.down[i], ZERO))
        up = (HALF - HALF * b.normal_d[i]) * open_
        low = open_ - up
        red, green, blue = b.red[i], b.green[i], b.blue[i]
        b.red[i] = red * red * (direct[0] * sun + above[0] * up + below[0] * low)
        b.green[i] = green * green * (direct[1] * sun + above[1] * up + below[1] * low)
        b.blue[i] = blue * blue * (direct[2] * sun + above[2] * up + below[2] * low)
        b.open[i] = open_


DAY = f4(1.44)
"""Exposure of a light's own gain (description.Light)."""


@streamed
def _add_glow(b: Block, n: int, exposure: np.float32) -> None:
    """Embers, which are as bright in a picture at night as by day: more than it can show."""
    bright = DAY / exposure
    for i in range(n):
        glow = b.glow[i]
        b.red[i] += glow * f4(0.95) * bright
        b.green[i] += glow * glow * f4(0.30) * bright
        b.blue[i] += glow * glow * f4(0.04) * bright


@streamed
def _add_mirror(b: Block, n: int, air: Air) -> None:
    """The sky in windows and paint."""
    for i in range(n):
        n_, e_, d_ = b.normal_n[i], b.normal_e[i], b.normal_d[i]
        way_n, way_e, way_d = b.way_n[i], b.way_e[i], b.way_d[i]
        along = TWO * (way_n * n_ + way_e * e_ + way_d * d_)
        red, green, blue = sky_light(air, way_n - along * n_, way_e - along * e_, along * d_ - way_d)
        miss = ONE + HALF * along
        mirror = b.mirror[i] * (f4(0.08) + f4(0.92) * miss * miss * miss * miss) * b.open[i]
        b.red[i] += (red - b.red[i]) * mirror
        b.green[i] += (green - b.green[i]) * mirror
        b.blue[i] += (blue - b.blue[i]) * mirror


@streamed
def _see_through_air(b: Block, n: int, air: Air) -> None:
    """Haze before it."""
    haze, horizon = f4(air.haze), air.rows[4]
    for i in range(n):
        clear = fading(b.distance[i] * haze)
        veil = ONE - clear
        b.red[i] = b.red[i] * clear + horizon[0] * veil
        b.green[i] = b.green[i] * clear + horizon[1] * veil
        b.blue[i] = b.blue[i] * clear + horizon[2] * veil


@streamed
def _light_sky(b: Block, n: int, air: Air, textures: Textures) -> None:
    for i in range(n):
        b.red[i], b.green[i], b.blue[i] = clouded_sky(air, textures, b.way_n[i], b.way_e[i], -b.way_d[i])


@streamed
def _develop(b: Block, n: int, air: Air) -> None:
    exposure = f4(air.exposure)
    for i in range(n):
        red, green, blue = (
            developed(b.red[i] * exposure),
            developed(b.green[i] * exposure),
            developed(b.blue[i] * exposure),
        )
        b.packed[i] = u4(blue | u4(green << u4(8)) | u4(red << u4(16)))


@part
def _find_light(b: Block, n: int, surfaces: Surfaces, air: Air) -> None:
    """The sun on pixels whose normals are known."""
    _find_sun(b, n, surfaces.sun, air)
    if surfaces.moving_sun.side > 0:
        _find_moving_shadows(b, n, surfaces.moving_sun)


@part
def _light(b: Block, n: int, surfaces: Surfaces, air: Air) -> None:
    """From own colours to light, of what is not water."""
    _find_light(b, n, surfaces, air)
    if surfaces.lamps.shape[0] > 0:
        find_firelight(b, n, surfaces.lamps, DAY / f4(air.exposure))
        _light_land(b, n, air)
        add_firelight(b, n)
    else:
        _light_land(b, n, air)


@part
def _shade_ground(b: Block, n: int, surfaces: Surfaces, camera: Pinhole, air: Air) -> None:
    find_places(b, n, camera)
    find_height(b, n, surfaces.relief.frame, surfaces.relief.shut, b.open)
    slope(b, n, surfaces.relief)
    colour_ground(b, n, surfaces)
    glows = burn_ground(b, n, surfaces, f4(air.time_s))
    _light(b, n, surfaces, air)
    if glows:
        _add_glow(b, n, f4(air.exposure))
    _see_through_air(b, n, air)


@part
def _shade_meshes(b: Block, n: int, surfaces: Surfaces, camera: Pinhole, air: Air) -> None:
    find_places(b, n, camera)
    find_height(b, n, surfaces.relief.frame, surfaces.relief.shut, b.open)
    mirrors = _colour_meshes(b, n, surfaces.textures)
    _light(b, n, surfaces, air)
    if mirrors:
        _add_mirror(b, n, air)
    _see_through_air(b, n, air)


@part
def _shade_water(b: Block, n: int, surfaces: Surfaces, camera: Pinhole, air: Air) -> None:
    find_places(b, n, camera)
    find_height(b, n, surfaces.relief.frame, surfaces.relief.shut, b.open)
    find_height(b, n, surfaces.relief.frame, surfaces.relief.height, b.height)
    _find_light(b, n, surfaces, air)
    light_water(b, n, surfaces, air)
    _see_through_air(b, n, air)


@part
def _put_down(b: Block, n: int, air: Air, bytes_: U8) -> None:
    """From light to a picture."""
    _develop(b, n, air)
    scatter(b, n, bytes_)


@kernel
def shade(
    seen: Buffers, drawn: Drawn, meshes: Meshes, things: Instances, surfaces: Surfaces, camera: Pinhole, air: Air,
    out: Picture, bytes_: U8, room: Block, known: Memory,
) -> None:  # fmt: skip
    """Fill a picture: `bytes_` are its colours; `room`, that of its width, and an empty `known` are used: pixels.py."""
    step, each = max(1, ABOUT // camera.width), len(room.at) // KINDS
    for first in range(0, camera.height, step):
        end = min(first + step, camera.height)
        ground, water, mesh, sky = sort_pixels(
            seen, drawn, meshes, things, surfaces.materials, camera, first, end, room, out, known
        )
        if ground:
            _shade_ground(room, ground, surfaces, camera, air)
            _put_down(room, ground, air, bytes_)
        if water:
            b = from_(room, each)
            _shade_water(b, water, surfaces, camera, air)
            _put_down(b, water, air, bytes_)
        if mesh:
            b = from_(room, 2 * each)
            _shade_meshes(b, mesh, surfaces, camera, air)
            _put_down(b, mesh, air, bytes_)
        if sky:
            b = from_(room, 3 * each)
            find_places(b, sky, camera)
            _light_sky(b, sky, air, surfaces.textures)
            _put_down(b, sky, air, bytes_)
