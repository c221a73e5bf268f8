"""The passes over all pixels, compiled by numba as the renderer's are: the same bytes on every processor.

A picture's figure is the square root of its light, as the renderer draws it (`render/README.md`): this stands for
sRGB's curve, and sums of light are made of squares.
"""

import numpy as np

from sitl_emu.world.render.kernel import F32, HALF, ONE, U8, ZERO, f4, kernel

WHITE = f4(255.0)
BLOCK = 8
"""Pixels that smear alike, along each side."""
BYTES_MEAN = f4(4 * 127.5)
BYTES_SIGMA = float(np.sqrt(4.0 * (256.0**2 - 1.0) / 12.0))
"""Of the sum of four bytes by chance."""
_u4 = np.uint32
_16, _15, _8, _24, _255 = _u4(16), _u4(15), _u4(8), _u4(24), _u4(255)
_MIX_A, _MIX_B = _u4(0x21F0AAAD), _u4(0x735A2D97)


@kernel
def look_back(rays_x: F32, rays_y: F32, ways: F32, focal_px: F32, middle: F32, map_x: F32, map_y: F32) -> None:
    """Where each pixel comes from in the picture drawn for the frame's time, for cv2.remap.

    `rays_x`, `rays_y` (height, width): the pixels' directions; `ways` (height, 15): of `motion.ways`, by row;
    `middle` (2,): the drawn picture's principal point; `map_x`, `map_y` (height, width) are written.
    """
    height, width = rays_x.shape
    focal, cx, cy = focal_px[0], middle[0], middle[1]
    for row in range(height):
        a, b, c = ways[row, 0], ways[row, 1], ways[row, 2]
        d, e, f = ways[row, 3], ways[row, 4], ways[row, 5]
        g, h, i = ways[row, 6], ways[row, 7], ways[row, 8]
        tx, ty, tz = ways[row, 9], ways[row, 10], ways[row, 11]
        nx, ny, nz = ways[row, 12], ways[row, 13], ways[row, 14]
        for column in range(width):
            x, y = rays_x[row, column], rays_y[row, column]
            down = max(nx * x + ny * y + nz, ZERO)
            by_z = focal / max(g * x + h * y + i + tz * down, f4(0.01))
            map_x[row, column] = (a * x + b * y + c + tx * down) * by_z + cx
            map_y[row, column] = (d * x + e * y + f + ty * down) * by_z + cy


@kernel
def smear(picture: U8, ways: F32, focal_px: F32, border: int, sums: F32, smeared: U8) -> None:
    """Blur along the way from the first to the second of two times: the mean light of so many pixels on it.

    `picture` (height + 2 border, 3 · (width + 2 border)); `smeared` (height, 3 · width) is written; `ways` (2, 15): of
    `motion.ways`; `sums` (3 · BLOCK): room to work in. BLOCK × BLOCK pixels have one way, that of their middle. One of
    less than a pixel leaves them sharp; one of more than 2 · border - 2 is cut.
    """
    height, width = smeared.shape[0], smeared.shape[1] // 3
    focal, cx, cy = focal_px[0], HALF * f4(width - 1), HALF * f4(height - 1)
    by_focal, most = ONE / focal, f4(2 * border - 2)
    for top in range(0, height, BLOCK):
        y = (f4(top) + f4(0.5 * (BLOCK - 1)) - cy) * by_focal
        for left in range(0, width, BLOCK):
            x = (f4(left) + f4(0.5 * (BLOCK - 1)) - cx) * by_focal
            dx = dy = ZERO
            for k in range(2):
                down = max(ways[k, 12] * x + ways[k, 13] * y + ways[k, 14], ZERO)
                by_z = focal / max(ways[k, 6] * x + ways[k, 7] * y + ways[k, 8] + ways[k, 11] * down, f4(0.01))
                dx = (ways[k, 0] * x + ways[k, 1] * y + ways[k, 2] + ways[k, 9] * down) * by_z - dx
                dy = (ways[k, 3] * x + ways[k, 4] * y + ways[k, 5] + ways[k, 10] * down) * by_z - dy
            length = np.sqrt(dx * dx + dy * dy)
            reach, end, by_length = np.int32(0), ONE, ONE
            if length > ONE:
                dx, dy = dx / length, dy / length
                length = min(length, most)
                reach = np.int32(np.ceil(HALF * (length - ONE)))
                end, by_length = HALF * (length + ONE) - f4(reach), ONE / length
            bottom, values = min(top + BLOCK, height), 3 * min(BLOCK, width - left)
            for row in range(top, bottom):
                for at in range(values):
                    sums[at] = ZERO
                for step in range(-reach, reach + 1):
                    weight = end * by_length if abs(step) == reach else by_length
                    r = row + border + np.int32(np.floor(f4(step) * dy + HALF))
                    first = 3 * (left + border + np.int32(np.floor(f4(step) * dx + HALF)))
                    for at in range(values):
                        figure = f4(picture[r, first + at])
                        sums[at] += weight * figure * figure
                for at in range(values):
                    smeared[row, 3 * left + at] = np.uint8(np.sqrt(sums[at]) + HALF)


@kernel
def expose(picture: U8, gains: F32, light_gain: F32, shot: F32, read: F32, key: np.uint32, exposed: U8) -> None:
    """Light through the lens to figures, with noise that is drawn for each value of each frame.

    `picture`, `gains`, `exposed` (height, 3 · width); `light_gain` (1,); `shot` and `read` (3 · width): variance by
    light and of darkness, white being 1, over the variance of four bytes' sum. The noise is such a sum, from a hash of
    the value's place and the frame's `key` (a mixer found by Chris Wellons' hash-prospector): near normal, at most 3.5
    sigma.
    """
    height, values = picture.shape
    gain = light_gain[0]
    for row in range(height):
        base = _u4(row * values)
        for at in range(values):
            chance = _u4((base + _u4(at)) ^ key)
            chance = _u4((chance ^ (chance >> _16)) * _MIX_A)
            chance = _u4((chance ^ (chance >> _15)) * _MIX_B)
            chance = _u4(chance ^ (chance >> _15))
            summed = (chance & _255) + ((chance >> _8) & _255) + ((chance >> _16) & _255) + (chance >> _24)
            figure = f4(picture[row, at])
            light = figure * figure * gains[row, at] * gain
            light += (f4(np.int32(summed)) - BYTES_MEAN) * np.sqrt(light * shot[at] + read[at])
            exposed[row, at] = np.uint8(WHITE * np.sqrt(min(max(light, ZERO), ONE)) + HALF)
