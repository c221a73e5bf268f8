"""The whole field at 5 cm a pixel, painted strip by strip as it comes into view, in memory that cameras may share.

The processes of several cameras of one world are given one file descriptor (a memfd: it has no name, so that nothing
can be left behind, and goes with the last process that holds it). Whoever looks at a strip that nobody has painted
paints it, under a lock on its byte (fcntl): while it does, others that need the strip paint their next one, or wait. A
painter that dies leaves its lock to the next, and the strip unmarked. What is painted is the same whoever does it when.
"""

import fcntl
import mmap
import os
from collections.abc import Callable

import numpy as np

from sitl_emu.world.kinds.corn_field.field import SURROUNDINGS_M, CornField
from sitl_emu.world.kinds.corn_field.painter import Layers, Painter

FIELD_GSD_M = 0.05
STRIP_ROWS = 64
"""Ours: a strip of 200 m takes 20 ms to paint and 8 MB meanwhile; what a UAS sees from 15 m are eight."""


class WholeField:
    """The painted field. `painter` is asked for one, of FIELD_GSD_M, when something must be painted."""

    def __init__(self, field: CornField, painter: Callable[[], Painter], shared_memory: int | None = None) -> None:
        """`shared_memory`: a descriptor of what the cameras of this very field share; None: memory of its own."""
        self._rows, self._columns = (round((side + 2.0 * SURROUNDINGS_M) / FIELD_GSD_M) for side in field.size_m)
        self._painter, self._lock_fd = painter, shared_memory
        layer_bytes = self._rows * self._columns * 4
        size = mmap.PAGESIZE + 2 * layer_bytes
        if shared_memory is None:
            memory = mmap.mmap(-1, size, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        else:
            os.ftruncate(shared_memory, size)
            memory = mmap.mmap(shared_memory, size)
        shape = (self._rows, self._columns, 4)
        # Pages that nobody has painted take no memory.
        self._is_painted = np.frombuffer(memory, np.uint8, mmap.PAGESIZE)
        ground = np.frombuffer(memory, np.uint8, layer_bytes, mmap.PAGESIZE).reshape(shape)
        canopy = np.frombuffer(memory, np.uint8, layer_bytes, mmap.PAGESIZE + layer_bytes).reshape(shape)
        self.layers = Layers(ground, canopy, -SURROUNDINGS_M, -SURROUNDINGS_M, FIELD_GSD_M)
        """All of it; of what was not asked for by `paint`, nothing may be there."""
        self._known = set[int]()

    def paint(self, first_row: float, last_row: float) -> None:
        """Have all rows painted that a bilinear look-up between these two reads, mirrored where they lie outside."""
        end = self._rows - 1
        first, last = first_row - 1.0, last_row + 2.0
        if first < -end or last > 2 * end or not first <= last:
            first, last = 0, end  # far off, or not a number
        mirrored = (max(last, -first), min(first, 2 * end - last))
        last, first = min(mirrored[0], end), max(mirrored[1], 0)
        strips = range(int(first) // STRIP_ROWS, int(last) // STRIP_ROWS + 1)
        taken = [strip for strip in strips if strip not in self._known and not self._have(strip, wait=False)]
        for strip in taken:
            self._have(strip, wait=True)

    def _have(self, strip: int, wait: bool) -> bool:
        """Have a strip painted; False where another paints it and there is no time to `wait`."""
        if self._lock_fd is None:
            self._paint(strip)
        else:
            try:
                fcntl.lockf(self._lock_fd, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB), 1, strip)
            except (BlockingIOError, PermissionError):
                return False
            try:
                if not self._is_painted[strip]:
                    self._paint(strip)
            finally:
                fcntl.lockf(self._lock_fd, fcntl.LOCK_UN, 1, strip)
        self._known.add(strip)
        return True

    def _paint(self, strip: int) -> None:
        part = strip * STRIP_ROWS, min((strip + 1) * STRIP_ROWS, self._rows)
        painted = self._painter().paint(-SURROUNDINGS_M, -SURROUNDINGS_M, self._rows, self._columns, part)
        rows = slice(*part)
        self.layers.ground[rows], self.layers.canopy[rows] = painted.ground, painted.canopy
        self._is_painted[strip] = 1
