"""What a camera over a corn field sees beyond it: farm land to the horizon, a line of trees, and the sky.

The land is Indiana's: parcels of the section lines' grid, each with a crop or tilled soil of its own, woods here and
there. All of it a function of the field's seed and the ray's direction, without textures.
"""

from typing import NamedTuple

import numpy as np

from sitl_emu.world.kinds.corn_field import haze
from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.haze import Haze, veiled
from sitl_emu.world.render.kernel import F32, F64, HALF, ONE, U8, ZERO, f4, inlined, kernel
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.sky import Air, air_of, developed, fading, sky_light

PARCEL_M = f4(201.0)
"""An eighth of a mile: the quarters of quarters that the section lines make."""
PALETTE = np.array(
    ((58, 116, 80), (66, 128, 92), (84, 106, 126), (96, 118, 138), (72, 132, 106), (104, 146, 156), (56, 106, 76)),
    np.float32,
)
"""BGR of corn, soya, tilled soil (twice), grass, stubble and alfalfa, by the painter's measure: ours, by eye."""
WOODS_BGR = np.array((46.0, 78.0, 50.0), np.float32)
FAR_M = f4(2500.0)
FINEST_M = f4(0.9)
"""Where a pixel covers more of the land than that, it shows neither rows nor clods."""
TREES_RISE = f4(0.024)
"""How steeply the highest trees at the horizon rise."""


class Backdrop(NamedTuple):
    """What `paint` looks up."""

    air: Air
    palette: F32
    """(n, 3), BGR, with the light's tint."""
    woods: F32
    haze: Haze
    bounds_px: F32
    """Columns and rows of the painted field: what lies within is not ours."""
    seed: np.int64


def of(field: CornField, tint: F64, columns: int, rows: int) -> Backdrop:
    """For a field, whose painted picture has so many columns and rows."""
    air = air_of(field.light)
    return Backdrop(
        air,
        (PALETTE * tint).astype(np.float32),
        (WOODS_BGR * tint).astype(np.float32),
        haze.of(field),
        np.array((columns, rows), np.float32),
        np.int64(field.seed),
    )


@inlined
def _chance(seed: np.int64, i: np.int64, j: np.int64) -> np.float32:
    """From 0 to 1, of a cell."""
    x = (i * np.int64(374761393) + j * np.int64(668265263) + seed * np.int64(1274126177)) & np.int64(0xFFFFFFFF)
    x = ((x ^ (x >> np.int64(13))) * np.int64(1274126177)) & np.int64(0xFFFFFFFF)
    x = (x ^ (x >> np.int64(16))) & np.int64(0xFFFF)
    return f4(x) * f4(1.0 / 65536.0)


@inlined
def _wavy(seed: np.int64, x: np.float32, y: np.float32) -> np.float32:
    """Smooth noise from 0 to 1, of cells of side 1."""
    i, j = np.int64(np.floor(x)), np.int64(np.floor(y))
    u, v = x - f4(i), y - f4(j)
    u, v = u * u * (f4(3.0) - u - u), v * v * (f4(3.0) - v - v)
    one = np.int64(1)
    low = _chance(seed, i, j) * (ONE - u) + _chance(seed, i + one, j) * u
    high = _chance(seed, i, j + one) * (ONE - u) + _chance(seed, i + one, j + one) * u
    return low * (ONE - v) + high * v


@inlined
def _trees_rise(seed: np.int64, north: np.float32, east: np.float32) -> np.float32:
    """How steeply the line of trees at the horizon rises in a direction (unit vector)."""
    # A square's outline instead of an angle: no arc tangent in a kernel.
    along = north / (abs(north) + abs(east))
    side = f4(2.0) if east < ZERO else ZERO
    at = side + (along if east >= ZERO else -along)
    wide = _wavy(seed, at * f4(9.0), f4(0.5))
    fine = _wavy(seed, at * f4(70.0), f4(3.5)) * f4(0.6) + _wavy(seed, at * f4(260.0), f4(7.5)) * f4(0.4)
    return max(wide - f4(0.25), ZERO) * (TREES_RISE / f4(0.75)) * (f4(0.55) + f4(0.45) * fine)


@kernel
def sky(rays: F64, air: Air, out: U8) -> None:
    """The sky's colours (n, 3) in directions (3, n)."""
    exposure = f4(air.exposure)
    for k in range(rays.shape[1]):
        n, e, d = f4(rays[0, k]), f4(rays[1, k]), f4(rays[2, k])
        norm = ONE / np.sqrt(n * n + e * e + d * d)
        r, g, b = sky_light(air, n * norm, e * norm, max(-d * norm, ZERO))
        out[k, 0], out[k, 1], out[k, 2] = developed(b * exposure), developed(g * exposure), developed(r * exposure)


@kernel
def paint(coordinates: F32, camera: Pinhole, height_m: float, scene: Backdrop, above: U8, out: U8) -> None:
    """Every pixel that sees beyond the painted field.

    `coordinates` (h, w, 2): of the painted picture, by pixel; `above` (h, w, 3): the sky as it would be seen.
    """
    rows, columns = coordinates.shape[0], coordinates.shape[1]
    seed, position, rotation, focal = scene.seed, camera.position, camera.rotation, camera.focal_px
    per_pixel = f4(1.0 / (focal * max(height_m, 0.1)))
    for row in range(rows):
        y = (row + 0.5 - 0.5 * rows) / focal
        for column in range(columns):
            x = (column + 0.5 - 0.5 * columns) / focal
            d = f4(rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2])
            px, py = coordinates[row, column, 0], coordinates[row, column, 1]
            inside = px >= ZERO and py >= ZERO and px < scene.bounds_px[0] and py < scene.bounds_px[1]
            if inside and d > ZERO:
                continue
            n = f4(rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2])
            e = f4(rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2])
            level = np.sqrt(n * n + e * e) + f4(1e-6)
            n, e, rise = n / level, e / level, -d / level
            if rise > TREES_RISE or (rise > ZERO and rise > _trees_rise(seed, n, e)):
                for k in range(3):
                    out[row, column, k] = above[row, column, k]
                continue
            away = f4(height_m) / max(-rise, f4(1e-5))
            if rise > ZERO or away > FAR_M:
                away = FAR_M
            north, east = f4(position[0]) + n * away, f4(position[1]) + e * away
            is_wood = rise > -f4(height_m) / FAR_M
            i, j = np.int64(np.floor(north / PARCEL_M)), np.int64(np.floor(east / PARCEL_M))
            kind = np.int64(_chance(seed, i, j) * f4(7.0))
            grain = f4(0.9) + f4(0.2) * _wavy(seed, north / f4(23.0), east / f4(23.0))
            # What a pixel covers along its ray, over what can be told apart
            fine = ONE - (away * away + f4(height_m) * f4(height_m)) * per_pixel / FINEST_M
            if fine > ZERO:
                along, aside = (north, east) if (i + j) & np.int64(1) == 0 else (east, north)
                rows = _wavy(seed, along / f4(5.0), aside / f4(0.38)) * HALF
                rows += _wavy(seed, along / f4(0.7), aside / f4(0.55)) * HALF
                grain *= ONE + fine * (f4(0.5) * rows - f4(0.25))
            clear = fading(away * scene.haze.per_m)
            for k in range(3):
                colour = scene.woods[k] * (f4(0.75) + HALF * grain) if is_wood else scene.palette[kind, k] * grain
                out[row, column, k] = np.uint8(min(veiled(scene.haze, max(colour, ZERO), k, clear), f4(255.0)))
