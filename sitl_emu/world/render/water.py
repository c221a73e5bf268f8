"""Water: ripples, the bottom through its murk, the sky by the angle of view, the sun's glint."""

import numpy as np

from sitl_emu.world.render.kernel import HALF, ONE, TWO, ZERO, f4, i4, part, streamed
from sitl_emu.world.render.land import NOISE, colour_ground
from sitl_emu.world.render.maps import Surfaces, Textures, grey, level_of
from sitl_emu.world.render.pixels import Block
from sitl_emu.world.render.sky import Air, fading, sky_light


@streamed
def _ripple(b: Block, n: int, textures: Textures, time_s: np.float32) -> None:
    """How the surface rises to north and to east: two patterns that drift apart."""
    t = time_s
    for i in range(n):
        north, east, footprint = b.north[i], b.east[i], b.footprint[i]
        level = level_of(footprint * f4(512.0 / 6.0))
        u, v = east * f4(1 / 6.0) + t * f4(0.021), north * f4(1 / 6.0) + t * f4(0.013)
        step = f4(1.0 / 512.0) * f4(i4(1) << level)
        here = grey(textures, NOISE, level, u, v)
        rise_e = grey(textures, NOISE, level, u + step, v) - here
        rise_n = grey(textures, NOISE, level, u, v + step) - here
        u, v = east * f4(1 / 2.1) - t * f4(0.043) + north * f4(0.11), north * f4(1 / 2.1) + t * f4(0.031)
        level = level_of(footprint * f4(512.0 / 2.1))
        step = f4(1.0 / 512.0) * f4(i4(1) << level)
        here = grey(textures, NOISE, level, u, v)
        rise_e += grey(textures, NOISE, level, u + step, v) - here
        rise_n += grey(textures, NOISE, level, u, v + step) - here
        calm = f4(0.0024) / (ONE + footprint * f4(6.0))
        b.rise_n[i], b.rise_e[i] = rise_n * calm, rise_e * calm


@streamed
def _refract(b: Block, n: int) -> None:
    """Ripples shift what is seen of the bottom."""
    for i in range(n):
        b.north[i] += b.rise_n[i]
        b.east[i] += b.rise_e[i]


@streamed
def _light(b: Block, n: int, air: Air) -> None:
    rows = air.rows
    high = max(-rows[0, 2], ZERO)
    for i in range(n):
        rise_n, rise_e, level = b.rise_n[i], b.rise_e[i], -b.down[i]
        way_n, way_e, way_d = b.way_n[i], b.way_e[i], b.way_d[i]
        slant = max(-way_n * rise_n - way_e * rise_e + way_d, f4(0.02))
        # Light goes down and up again
        murk = ONE - fading(max(level - b.height[i], ZERO) * TWO * b.u[i])
        miss = ONE - min(slant, ONE)
        mirror = miss * miss
        mirror = f4(0.025) + f4(0.975) * mirror * mirror * miss
        n_, e_, u_ = way_n + TWO * slant * rise_n, way_e + TWO * slant * rise_e, -way_d + TWO * slant
        by_length = ONE / np.sqrt(n_ * n_ + e_ * e_ + u_ * u_)
        n_, e_, u_ = n_ * by_length, e_ * by_length, max(u_ * by_length, f4(0.01))
        sky_r, sky_g, sky_b = sky_light(air, n_, e_, u_)
        # The sun's own image is not to be seen from the shade
        most = ONE + f4(20.0) * b.sun[i]
        sky_r, sky_g, sky_b = min(sky_r, most), min(sky_g, most), min(sky_b, most)
        open_ = ONE / (ONE + f4(0.12) * max(b.open[i] + b.down[i], ZERO))
        # The ripples of a pixel that covers many are not seen one by one: they widen the sun's image, and dim it
        far = b.footprint[i] / (b.footprint[i] + f4(0.08))
        wide, keeps = f4(0.04) + f4(0.05) * far, ONE - f4(0.8) * far
        towards = (way_n + (n_ - way_n) * keeps) * rows[0, 0] + (way_e + (e_ - way_e) * keeps) * rows[0, 1]
        towards -= (way_d + (u_ - way_d) * keeps) * rows[0, 2]
        glint = max(towards - (ONE - wide), ZERO) / wide
        glint = glint * glint
        glint = glint * glint * f4(7.8 * 0.04) / wide * b.sun[i] * mirror
        sun, clear, shown = b.sun[i] * high, (ONE - murk) * HALF, ONE - mirror
        sky_share = (HALF + HALF * open_) * mirror
        red, green, blue = b.red[i], b.green[i], b.blue[i]
        body = b.tint_r[i] * b.tint_r[i] * murk + red * red * clear
        b.red[i] = body * (rows[1, 0] * sun + rows[2, 0] * open_) * shown + sky_r * sky_share + rows[1, 0] * glint
        body = b.tint_g[i] * b.tint_g[i] * murk + green * green * clear
        b.green[i] = body * (rows[1, 1] * sun + rows[2, 1] * open_) * shown + sky_g * sky_share + rows[1, 1] * glint
        body = b.tint_b[i] * b.tint_b[i] * murk + blue * blue * clear
        b.blue[i] = body * (rows[1, 2] * sun + rows[2, 2] * open_) * shown + sky_b * sky_share + rows[1, 2] * glint


@part
def light_water(b: Block, n: int, surfaces: Surfaces, air: Air) -> None:
    """Light that comes from water, where relief and sun are known."""
    _ripple(b, n, surfaces.textures, f4(air.time_s))
    _refract(b, n)
    colour_ground(b, n, surfaces)
    _light(b, n, air)
