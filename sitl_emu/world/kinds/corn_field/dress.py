"""Colours of what stands in a corn field and is no plant: the general renderer's textures, in the field's light."""

from typing import NamedTuple

import numpy as np

from sitl_emu.world.kinds.corn_field.haze import Haze, slant, veiled
from sitl_emu.world.render.kernel import F32, HALF, I32, ONE, U8, ZERO, f4, i4, kernel
from sitl_emu.world.render.maps import Textures, level_of, texel
from sitl_emu.world.render.pixels import FARTHEST_M, plane_of, texture_of
from sitl_emu.world.render.raster import Buffers, Drawn, Instances, Meshes, Pinhole
from sitl_emu.world.render.sky import fading

PLAIN = -1
"""The texture of a face that has none, but its tint."""


class Cloth(NamedTuple):
    """What faces are made of."""

    layers: I32
    """(t,): textures, or PLAIN."""
    textures: Textures
    light: F32
    """(t, 2, 3): red, green, blue that a white face has in a picture, on the side of its normal and on the other."""


@kernel
def dress(
    seen: Buffers, drawn: Drawn, meshes: Meshes, things: Instances, cloth: Cloth, camera: Pinhole, haze: Haze, p: F32,
    out: U8,
) -> None:  # fmt: skip
    """The colour of every pixel that a triangle was drawn to; `p` (pixels.FIGURES,) is used."""
    by_focal = f4(1.0 / camera.focal_px)
    middle_x, middle_y = f4(camera.width) * HALF, f4(camera.height) * HALF
    r = camera.rotation
    last_number, last_slot = -2, -2
    for row in range(camera.height):
        y = (f4(row) + HALF - middle_y) * by_focal
        for column in range(camera.width):
            at = row * camera.width + column
            number, slot = seen.triangle[at], seen.slot[at]
            if number < 0:
                continue
            if number != last_number or slot != last_slot:
                last_number, last_slot = number, slot
                plane_of(drawn, meshes, slot, number, p)
                texture_of(drawn, meshes, things, slot, number, p)
            x, length = (f4(column) + HALF - middle_x) * by_focal, slant(camera, row, column)
            along = p[15] * x + p[16] * y + p[17]
            z = p[18] / along
            z = z if ZERO < z < FARTHEST_M else FARTHEST_M
            red, green, blue = p[12], p[13], p[14]
            if cloth.layers[number] != PLAIN:
                facing = abs(along) * p[19] / length
                footprint = z * length * by_focal / np.sqrt(max(facing, f4(0.02)))
                u = p[0] * x * z + p[1] * y * z + p[2] * z + p[3]
                v = p[4] * x * z + p[5] * y * z + p[6] * z + p[7]
                level = level_of(footprint * p[8] * f4(512.0))
                own_r, own_g, own_b, takes = texel(cloth.textures, i4(cloth.layers[number]), level, u, v)
                takes *= f4(1.0 / 255.0)
                red = own_r * f4(1.0 / 255.0) * (ONE + (red - ONE) * takes)
                green = own_g * f4(1.0 / 255.0) * (ONE + (green - ONE) * takes)
                blue = own_b * f4(1.0 / 255.0) * (ONE + (blue - ONE) * takes)
            away = ZERO
            for k in range(3):
                away += p[9 + k] * (f4(r[k, 0]) * x + f4(r[k, 1]) * y + f4(r[k, 2]))
            light = cloth.light[number, 0 if away < ZERO else 1]
            clear = fading(haze.per_m * length * z)
            out[row, column, 0] = np.uint8(veiled(haze, min(blue * light[2], f4(255.0)), 0, clear))
            out[row, column, 1] = np.uint8(veiled(haze, min(green * light[1], f4(255.0)), 1, clear))
            out[row, column, 2] = np.uint8(veiled(haze, min(red * light[0], f4(255.0)), 2, clear))
