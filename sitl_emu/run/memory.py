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


MMAP_THRESHOLD, LARGE_BYTES = -3, 4 << 20
"""glibc's number of that option (malloc.h), and from what size on memory is a mapping of its own."""


def give_back_large() -> None:
    """From now on what is large goes back to the system as soon as it is freed (glibc's mallopt).

    Left alone, glibc takes what was freed last for small from then on, up to 32 MiB, and keeps its room: 35 MiB of a
    flood's camera. What a picture of 640 x 480 needs is smaller, and is kept.
    """
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)
    if set_option is not None:
        set_option(MMAP_THRESHOLD, LARGE_BYTES)


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
