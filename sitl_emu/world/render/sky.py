"""The sky, the sun and the air between: colours in linear light, red, green, blue."""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.world.description import Light
from sitl_emu.world.render.kernel import F32, ONE, ZERO, f4, i4, inlined, u4
from sitl_emu.world.render.maps import Textures, grey

LEFT = 3.0
"""Extinction times `Light.visibility_m`: exp(-3) is a twentieth."""
CLOUDS = i4(1)
"""The texture that clouds are made of."""


class Air(NamedTuple):
    """Light from above; each row of `rows` a colour or a direction."""

    rows: F32
    """To the sun (NED), sunlight, light of the sky from above, from below, of the horizon, of the zenith: (6, 3)."""
    haze: float
    """Per metre."""
    exposure: float
    """What light is multiplied with, before the square root that makes it a picture's figure."""
    time_s: float


def air_of(light: Light, time_s: float = 0.0) -> Air:
    """A clear day, by the sun's height; a share of light from the sky that makes shadows blue, not black."""
    azimuth, elevation = math.radians(light.azimuth_deg), math.radians(light.elevation_deg)
    sine = math.sin(elevation)
    to_sun = (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), -sine)
    warm = light.warmth**0.5
    # A low sun has lost its blue, and most of its strength, to the air (Kasten and Young's air mass, 1989).
    mass = 1.0 / (sine + 0.50572 * (light.elevation_deg + 6.07995) ** -1.6364)
    depth = np.array((0.06, 0.11, 0.23))
    direct = np.exp(-depth * mass) * np.array((1.0, 0.98, 0.96)) * np.array((warm, 1.0, 1.0 / warm))
    day = min(1.0, 0.18 + 1.1 * sine)
    above = day * np.array((0.225, 0.270, 0.340))
    below = day * np.array((0.115, 0.105, 0.085))
    glow = max(0.0, 1.0 - sine / 0.35)
    horizon = day * (np.array((0.66, 0.74, 0.84)) * (1.0 - glow) + glow * np.array((1.15, 0.78, 0.55)) * warm)
    zenith = day * np.array((0.105, 0.235, 0.52))
    rows = np.array((to_sun, direct * 0.83, above, below, horizon, zenith), np.float32)
    return Air(rows, LEFT / light.visibility_m, light.gain**2, time_s)


@inlined
def fading(x: np.float32) -> np.float32:
    """About exp(-x), for x from 0 on."""
    return ONE / (ONE + x * (ONE + x * (f4(0.5) + x * f4(0.1667))))


@inlined
def sky_light(
    air: Air, north: np.float32, east: np.float32, up: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """What comes from a direction (unit vector) of a sky without clouds."""
    rows = air.rows
    high = max(up, ZERO)
    t = ONE - high
    t = t * t
    t = t * t * (f4(0.6) + f4(0.4) * t)
    towards = north * rows[0, 0] + east * rows[0, 1] - up * rows[0, 2]
    glow = max(towards, ZERO)
    wide = glow * glow
    wide = wide * wide * f4(0.12)
    narrow = glow * glow * glow * glow
    narrow = narrow * narrow
    narrow = narrow * narrow
    narrow = narrow * narrow * f4(0.35)
    bright = wide + narrow + (f4(14.0) if towards > f4(0.99996) else ZERO)
    return (
        rows[5, 0] + (rows[4, 0] - rows[5, 0]) * t + rows[1, 0] * bright,
        rows[5, 1] + (rows[4, 1] - rows[5, 1]) * t + rows[1, 1] * bright,
        rows[5, 2] + (rows[4, 2] - rows[5, 2]) * t + rows[1, 2] * bright,
    )


@inlined
def clouded_sky(
    air: Air, textures: Textures, north: np.float32, east: np.float32, up: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """The same with fair-weather clouds, which thin out towards the horizon and drift."""
    r, g, b = sky_light(air, north, east, up)
    far = ONE / (max(up, ZERO) + f4(0.12))
    u, v = east * far * f4(0.11) + f4(air.time_s) * f4(0.0002), north * far * f4(0.11)
    level = i4(0) if up > f4(0.3) else i4(1)
    dense = grey(textures, CLOUDS, level, u, v) * f4(1.0 / 255.0)
    fine = grey(textures, CLOUDS, level, u * f4(3.7) + f4(0.31), v * f4(3.7)) * f4(1.0 / 255.0)
    cover = min(max((dense * f4(0.8) + fine * f4(0.25) - f4(0.56)) * f4(3.2), ZERO), ONE)
    cover *= min(max((up - f4(0.02)) * f4(9.0), ZERO), ONE) * f4(0.8)
    shade = f4(0.95) - f4(0.25) * dense
    white, lit = air.rows[4], air.rows[1]
    r += ((white[0] * f4(0.7) + lit[0] * f4(0.45)) * shade - r) * cover
    g += ((white[1] * f4(0.7) + lit[1] * f4(0.45)) * shade - g) * cover
    b += ((white[2] * f4(0.7) + lit[2] * f4(0.45)) * shade - b) * cover
    return r, g, b


@inlined
def developed(light: np.float32) -> np.uint32:
    """A picture's figure of linear light: its square root, the brightest softly held."""
    root = np.sqrt(max(light, ZERO))
    over = max(root - f4(0.8), ZERO)
    root = min(root, f4(0.8)) + over / (ONE + over * f4(3.0))
    return u4(i4(min(root * f4(255.0) + f4(0.5), f4(255.0))))
