"""The whole field at 5 cm a pixel (its ground at 10 along the rows), in memory that cameras may share.

It is painted strip by strip as it comes into view. The processes of several cameras of one world are given one file
descriptor (a memfd: it has no name, so that nothing can be left behind, and goes with the last process that holds it).
Whoever looks at a strip that nobody has painted paints it, under a lock on its byte (fcntl): while it does, others that
need the strip paint their next one, or wait. A painter that dies leaves its lock to the next, and the strip unmarked.
What is painted is the same whoever does it when.
"""

import fcntl
import mmap
import os
from collections.abc import Callable

import cv2
import numpy as np

from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.painter import Layers, Painter
from sitl_emu.world.kinds.corn_field.sprites import Image

FIELD_GSD_M = 0.05
PAINTED_M = 12.0
"""How far around the outline is painted: the grass, and some of the soil beyond. Further off is backdrop.py's."""
SQUEEZE = 2
"""Rows of the canopy that one of the ground's stands for. The rows of corn run north, so that what lies between them is
as sharp across them as it was, and a field of 200 m takes 40 MB less."""
STRIP_ROWS = 64
"""Ours: a strip of 200 m takes 20 ms to paint and 8 MB meanwhile; what a UAS sees from 15 m are eight."""


def squeezed(ground: Image) -> Image:
    """A painted ground with SQUEEZE rows made one."""
    size = (ground.shape[1], len(ground) // SQUEEZE)
    return np.asarray(cv2.resize(ground, size, interpolation=cv2.INTER_AREA), np.uint8)


class WholeField:
    """The painted field. `painter` is asked for one, of FIELD_GSD_M, when something must be painted."""

    def __init__(self, field: CornField, painter: Callable[[], Painter], shared_memory: int | None = None) -> None:
        """`shared_memory`: a descriptor of what the cameras of this very field share; None: memory of its own."""
        rows, self._columns = (round((side + 2.0 * PAINTED_M) / FIELD_GSD_M) for side in field.size_m)
        self._rows = rows + rows % SQUEEZE
        self._painter, self._lock_fd = painter, shared_memory
        layer_bytes = self._rows * self._columns * 4
        size = mmap.PAGESIZE + layer_bytes + layer_bytes // SQUEEZE
        if shared_memory is None:
            memory = mmap.mmap(-1, size, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        else:
            os.ftruncate(shared_memory, size)
            memory = mmap.mmap(shared_memory, size)
        shape = (self._rows, self._columns, 4)
        # Pages that nobody has painted take no memory.
        self._is_painted = np.frombuffer(memory, np.uint8, mmap.PAGESIZE)
        canopy = np.frombuffer(memory, np.uint8, layer_bytes, mmap.PAGESIZE).reshape(shape)
        ground = np.frombuffer(memory, np.uint8, layer_bytes // SQUEEZE, mmap.PAGESIZE + layer_bytes)
        ground = ground.reshape(self._rows // SQUEEZE, self._columns, 4)
        self.layers = Layers(ground, canopy, -PAINTED_M, -PAINTED_M, FIELD_GSD_M, SQUEEZE)
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
        painted = self._painter().paint(-PAINTED_M, -PAINTED_M, self._rows, self._columns, part)
        self.layers.canopy[slice(*part)] = painted.canopy
        self.layers.ground[part[0] // SQUEEZE : part[1] // SQUEEZE] = squeezed(painted.ground)
        self._is_painted[strip] = 1
