"""The memory of a process that has just begun: what it has imported and read from files stays until its end."""

import contextlib
import ctypes
import gc
from collections.abc import Iterator


@contextlib.contextmanager
def all_stays() -> Iterator[None]:
    """For imports and tables: the garbage collector does not look at what is made, neither meanwhile nor later.

    While modules are imported it finds next to nothing, and would take a fifth of the time: it is woken by how many
    objects are new.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_on:
            gc.enable()


MMAP_THRESHOLD, TRIM_THRESHOLD = -3, -1
"""glibc's numbers of two options (malloc.h): from what size on memory is a mapping of its own, which goes back to the
system when it is freed; and from how much free at the heap's end on that goes back."""
LARGE_BYTES, LARGEST_BYTES = 4 << 20, 32 << 20
"""What is large: more than what a picture of 640 x 480 is made of; ours. And glibc's own greatest threshold."""


@contextlib.contextmanager
def large_goes_back() -> Iterator[None]:
    """For a scene that is built: what is large is given back to the system as soon as it is freed (glibc's mallopt).

    Left alone, glibc takes what was freed last for small from then on, and keeps its room: 35 MiB of a flood's camera.
    Afterwards it does keep it: a process that goes on with large arrays would get each zeroed page by page.
    """
    _keep_below(LARGE_BYTES)
    try:
        yield
    finally:
        _keep_below(LARGEST_BYTES)


def _keep_below(size_bytes: int) -> None:
    """What is freed is kept if it is smaller."""
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)
    if set_option is not None:
        set_option(MMAP_THRESHOLD, size_bytes)
        set_option(TRIM_THRESHOLD, 2 * size_bytes)


def settle() -> None:
    """Before the first tick: what is there stays, and the garbage collector need not look at it again."""
    gc.collect()
    gc.freeze()
    trim_heap()


def trim_heap() -> None:
    """Give the system back what imports have left free (glibc's malloc_trim; no effect with another C library).

    Where bytecode can't be kept (a read-only install, PYTHONDONTWRITEBYTECODE), compiling the MAVLink dialect at each
    start leaves 55 MiB.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
