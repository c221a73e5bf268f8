"""Arrays that the processes of several cameras of one world share: the first to need them makes them.

All are given the descriptor of one memfd (it has no name, so that nothing is left behind, and goes with the last
process that holds it). Whoever comes first makes the arrays under a lock (fcntl) and says last where they lie: one that
dies meanwhile leaves the lock to the next, which begins anew.
"""

import contextlib
import fcntl
import json
import mmap
import os
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
HEAD_BYTES = 4096
"""Before the arrays: the index, JSON."""
ALIGNED_BYTES = 64


@contextlib.contextmanager
def turn(fd: int | None) -> Iterator[bool]:
    """Whether this process is to make them: nobody has, and nobody else will until the end of the block.

    For what may be begun before `arrays` is called.
    """
    try:
        yield fd is None or (not _read_index(fd) and _is_locked(fd))
    finally:
        if fd is not None:
            fcntl.lockf(fd, fcntl.LOCK_UN, 1, 0)


def _is_locked(fd: int) -> bool:
    """By this process, without waiting."""
    try:
        fcntl.lockf(fd, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, 0)
    except BlockingIOError:
        return False
    return True


def arrays(fd: int | None, make: Callable[[], Iterable[Array]]) -> list[Array]:
    """Those of `make`, which is called by one process alone; None: by this one, for itself."""
    if fd is None:
        return list(make())
    fcntl.lockf(fd, fcntl.LOCK_EX, 1, 0)
    try:
        index = _read_index(fd) or _write(fd, make())
    finally:
        fcntl.lockf(fd, fcntl.LOCK_UN, 1, 0)
    memory = mmap.mmap(fd, 0)
    return [
        np.frombuffer(memory, np.dtype(kind), int(np.prod(shape)), offset).reshape(shape)
        for kind, shape, offset in index
    ]


def _read_index(fd: int) -> list[Any]:
    head = os.pread(fd, HEAD_BYTES, 0).rstrip(b"\0")
    return list(json.loads(head)) if head else []


def _write(fd: int, made: Iterable[Array]) -> list[Any]:
    """One after another, so that none need be in memory twice for longer than it takes."""
    os.ftruncate(fd, 0)
    index, end = list[Any](), HEAD_BYTES
    for array in made:
        index.append((array.dtype.str, array.shape, end))
        os.ftruncate(fd, end + array.nbytes)
        # What is not written is zero, and takes no memory
        if array.any():
            view = memoryview(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
            done = 0
            while done < len(view):
                done += os.pwrite(fd, view[done:], end + done)
        end += -(-array.nbytes // ALIGNED_BYTES) * ALIGNED_BYTES
    os.pwrite(fd, json.dumps(index).encode(), 0)
    return index
