"""Haze before a corn field: what the air between adds to ground, plants and things, as the general renderer has it."""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.render.kernel import F32, F64, HALF, ONE, U8, ZERO, f4, inlined, kernel
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.sky import air_of, fading

UNSEEN = 0.02
"""A veil that is not worth a pass over the picture: about two of 255. A survey's height on a clear day has less."""
BEYOND = f4(1.0 / 600.0)
"""Farther away than a field reaches, all is the backdrop's, which has haze of its own."""
BEFORE = f4(250.0)
"""So many times nearer than where haze hides two thirds, it does not change a figure."""


class Haze(NamedTuple):
    """The air over a field."""

    per_m: np.float32
    """Extinction."""
    bgr: F32
    """(3,): of the horizon, which all takes on far away."""

    def is_seen(self, away_m: float) -> bool:
        """Whether any is, before what lies so far away."""
        return bool(away_m * self.per_m >= UNSEEN)

    def within(self, reach_m: float) -> "Haze":
        """The same, or none where what is drawn lies so near that there is none to be seen."""
        return self if self.is_seen(reach_m) else self._replace(per_m=ZERO)


def of(field: CornField) -> Haze:
    """The air over a field."""
    air = air_of(field.light)
    root = np.sqrt(air.rows[4][::-1] * air.exposure)
    over = np.maximum(root - 0.8, 0.0)
    # As sky.developed has it: the haze ends in the sky's own colour at the horizon
    return Haze(f4(air.haze), (255.0 * np.minimum(root - over + over / (1.0 + 3.0 * over), 1.0)).astype(np.float32))


@inlined
def veiled(haze: Haze, colour: np.float32, k: int, clear: np.float32) -> np.float32:
    """A channel of a colour, 0 to 255, of whose light so much comes through."""
    far = haze.bgr[k] * haze.bgr[k]
    return f4(np.sqrt(far + (colour * colour - far) * clear))


@inlined
def slant(camera: Pinhole, row: int, column: int) -> np.float32:
    """How much farther away a pixel's place is than its distance along the optical axis: a factor."""
    x = f4((column + 0.5 - 0.5 * camera.width) / camera.focal_px)
    y = f4((row + 0.5 - 0.5 * camera.height) / camera.focal_px)
    return f4(np.sqrt(x * x + y * y + ONE))


@kernel
def veil(nearness: F32, haze: Haze, out: U8) -> None:
    """Put haze before every pixel of a picture (h, w, 3); `nearness` (h, w): 1 / distance, m."""
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            near = nearness[row, column]
            if near < BEYOND or near > BEFORE * haze.per_m:
                continue
            clear = fading(haze.per_m / near)
            for k in range(3):
                out[row, column, k] = np.uint8(veiled(haze, f4(out[row, column, k]), k, clear) + HALF)


def nearness(north: F64, east: F64, position: F64, above_m: float) -> F64:
    """1 / distance of places on the ground from a camera so far above it: between them, linear on level ground."""
    away: F64 = np.sqrt((north - position[0]) ** 2 + (east - position[1]) ** 2 + above_m**2)
    return 1.0 / away


def farthest_m(near: F64) -> float:
    """Of those."""
    least = float(near.min())
    return 1.0 / least if least > 0.0 else math.inf
