"""The ground near a camera, at 1.6 cm a pixel: a square of tiles, joined to one picture, that moves with the view."""

import math
from collections.abc import Callable

import numpy as np

from sitl_emu.world.kinds.corn_field.painter import Layers, Painter

TILE_GSD_M = 0.016
TILE_PIXELS = 250
TILE_M = TILE_GSD_M * TILE_PIXELS
NO_PLANTS = np.zeros((0, 0, 4), np.uint8)
"""Where they can be seen so near, they stand (standing.py)."""
TILES = 5
"""Along each side of the mosaic."""


class Mosaic:
    """The tiles around a place. `painter` is asked for one, of TILE_GSD_M, when tiles must be painted."""

    def __init__(self, painter: Callable[[], Painter]) -> None:
        self._painter = painter
        self._corner: tuple[int, int] | None = None
        """Row and column of the south-western tile."""
        side = TILES * TILE_PIXELS
        self._ground = np.empty((side, side, 4), np.uint8)

    def around(self, north_m: float, east_m: float) -> Layers:
        """Centred on the tile of a place; valid until it is asked for another."""
        half = TILES // 2
        corner = math.floor(north_m / TILE_M) - half, math.floor(east_m / TILE_M) - half
        if corner != self._corner:
            self._move(*corner)
        return Layers(self._ground, NO_PLANTS, corner[0] * TILE_M, corner[1] * TILE_M, TILE_GSD_M)

    def _move(self, row: int, column: int) -> None:
        """In place: tiles kept apart, or another mosaic to copy to, would take its memory once more."""
        if self._corner is None:
            up, right = TILES, TILES
        else:
            up, right = row - self._corner[0], column - self._corner[1]
        self._corner = None
        if abs(up) < TILES and abs(right) < TILES:
            self._ground[_kept(-up), _kept(-right)] = self._ground[_kept(up), _kept(right)]
        for i in range(TILES):
            for j in range(TILES):
                if 0 <= i + up < TILES and 0 <= j + right < TILES:
                    continue
                tile = self._painter().paint((row + i) * TILE_M, (column + j) * TILE_M, TILE_PIXELS, TILE_PIXELS)
                rows, columns = (slice(k * TILE_PIXELS, (k + 1) * TILE_PIXELS) for k in (i, j))
                self._ground[rows, columns] = tile.ground
        self._corner = row, column


def _kept(moved: int) -> slice:
    """Of a side, the pixels that are still in the mosaic when it has moved by so many tiles, as they were before."""
    return slice(max(moved, 0) * TILE_PIXELS, (TILES + min(moved, 0)) * TILE_PIXELS)
