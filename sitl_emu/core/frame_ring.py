"""Feeds between processes: images, depth and point clouds in a ring of shared memory, each with its simulated time.

A ring is a file in /dev/shm with one writer and any number of readers, none of whom waits for another. Its header says
what it carries (`Format`); then come the slots, each with the number and the time of what lies in it. The writer takes
a slot's number away before it writes there, and gives the new one after: a reader that finds another number after its
copy than before knows that the slot was overwritten meanwhile. A reader that falls more than `slots` behind loses
samples, and `lost` counts them.

The writer holds a lock (flock) on the file for as long as it lives, however it ends: so a reader sees that no more will
come (`ended`), and a ring that a killed writer left is replaced by whoever makes the next of its name. A ring gets its
name when it is whole. Numbers are written by one aligned store each, as a reader may look at any moment.
"""

import enum
import fcntl
import mmap
import os
import struct
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
FOLDER = Path("/dev/shm")
DESCRIPTORS = "/proc/self/fd"

_HEADER = struct.Struct("<4sB3x8sIII")
_MAGIC = b"SFR2"
_COUNT_AT, _CLOSED_AT = 32, 40
_NUMBER, _TIME, _ROWS = 0, 1, 2
"""The three words (uint64) that a slot begins with; `_ROWS`: how many rows of the sample are there."""
_SLOT_HEAD = 24
_ALIGN = 64
_NOBODY = (1 << 64) - 1
"""The number of a slot that is being written, or never was."""


class RingError(Exception):
    """A ring that can't be made, found or read; the text is one line for people."""


class Kind(enum.IntEnum):
    """What a feed carries."""

    IMAGE = 1
    DEPTH = 2
    """Distance along the optical axis; inf where nothing is near enough (ROS REP 118)."""
    POINTS = 3
    """Points of one scan, in metres."""


class Encoding(enum.Enum):
    """How a pixel or a point is laid out, by ROS's names (sensor_msgs/image_encodings.h), and xyz32f: three floats."""

    BGR8 = "bgr8"
    RGB8 = "rgb8"
    MM16 = "16UC1"
    """Millimetres, 0 where nothing is (ROS REP 118)."""
    M32 = "32FC1"
    """Metres."""
    XYZ32 = "xyz32f"

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of a number."""
        return np.dtype(_LAYOUT[self][0])

    @property
    def numbers(self) -> int:
        """How many numbers a pixel or a point has."""
        return _LAYOUT[self][1]


_LAYOUT = {
    Encoding.BGR8: ("u1", 3),
    Encoding.RGB8: ("u1", 3),
    Encoding.MM16: ("<u2", 1),
    Encoding.M32: ("<f4", 1),
    Encoding.XYZ32: ("<f4", 3),
}


class Format(NamedTuple):
    """What a ring carries. A cloud is one point wide, and at most `height` points long."""

    kind: Kind
    encoding: Encoding
    height: int
    width: int = 1

    @property
    def shape(self) -> tuple[int, ...]:
        """Of a whole sample as an array: (height, width, 3) of an image, (height, width) of depth, (height, 3) of
        points.
        """
        sides = (self.height,) if self.kind is Kind.POINTS else (self.height, self.width)
        return sides if self.encoding.numbers == 1 else (*sides, self.encoding.numbers)

    @property
    def size(self) -> int:
        """Bytes of a whole sample."""
        return self.height * self.width * self.encoding.numbers * self.encoding.dtype.itemsize

    @property
    def slot_size(self) -> int:
        """Bytes from slot to slot."""
        return (_SLOT_HEAD + self.size + _ALIGN - 1) // _ALIGN * _ALIGN


class Sample(NamedTuple):
    """One image, depth image or cloud."""

    number: int
    """From 0 within its feed."""
    time_us: int
    data: Array


class RingWriter:
    """The one who makes a ring, writes into it, and removes it."""

    def __init__(self, name: str, what: Format, slots: int = 8) -> None:
        """Raises RingError when somebody alive writes to a ring of that name, or shared memory has no room for it."""
        self.name, self.what, self.slots = name, what, slots
        self._count = 0
        size = _ALIGN + slots * what.slot_size
        try:
            self._file = os.open(FOLDER, os.O_RDWR | os.O_TMPFILE | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise _no_room(name, size, error) from None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.posix_fallocate(self._file, 0, size)
            self._memory = mmap.mmap(self._file, size)
            encoding = what.encoding.value.encode()
            _HEADER.pack_into(self._memory, 0, _MAGIC, what.kind, encoding, slots, what.height, what.width)
            self._written, self._heads = _views(self._memory, what, slots)
            self._heads[:, _NUMBER] = _NOBODY
            self._give_name()
        except OSError as error:
            os.close(self._file)
            raise _no_room(name, size, error) from None
        except RingError:
            os.close(self._file)
            raise

    @property
    def next_data(self) -> Array:
        """The memory of the sample that is written next, to be filled in place; `commit` publishes it."""
        slot = self._count % self.slots
        self._heads[slot, _NUMBER] = _NOBODY
        return _data(self._memory, self.what, slot, self.what.height)

    def write(self, time_us: int, data: Array) -> None:
        """Add a sample; of a cloud with fewer points than there is room for, those."""
        self.next_data[: len(data)] = data
        self.commit(time_us, len(data))

    def commit(self, time_us: int, rows: int | None = None) -> None:
        """Publish what stands in `next_data`, or its first `rows`."""
        head = self._heads[self._count % self.slots]
        head[_TIME], head[_ROWS] = time_us, self.what.height if rows is None else rows
        head[_NUMBER] = self._count
        self._count += 1
        self._written[0] = self._count

    def close(self) -> None:
        """Say that no more comes, and remove the ring; readers keep what they have mapped. May be called twice."""
        if self._file >= 0:
            self._memory[_CLOSED_AT] = 1
            (FOLDER / self.name).unlink(missing_ok=True)
            os.close(self._file)
            self._file = -1

    def _give_name(self) -> None:
        """Show the ring under its name. Raises RingError."""
        folder = os.open(DESCRIPTORS, os.O_PATH | os.O_CLOEXEC)
        try:
            for _ in range(2):
                try:
                    os.link(str(self._file), FOLDER / self.name, src_dir_fd=folder, follow_symlinks=True)
                    return
                except FileExistsError:
                    if not remove_if_left(self.name):
                        break
        finally:
            os.close(folder)
        raise RingError(f"shm:{self.name}: there is such a ring already, and whoever writes to it is alive")


def _no_room(name: str, size: int, error: OSError) -> RingError:
    mib = -(-size // (1 << 20))
    return RingError(
        f"shm:{name}: can't be made: {error.strerror}; {FOLDER} needs {mib} MiB for it (a container's: --shm-size=1g)"
    )


class RingReader:
    """One who reads a ring."""

    def __init__(self, name: str) -> None:
        """Raises RingError when there is no such ring."""
        self.name = name
        try:
            self._file = os.open(FOLDER / name, os.O_RDONLY | os.O_CLOEXEC)
        except OSError as error:
            raise RingError(
                f"shm:{name}: there is no such ring of frames ({error.strerror}); is the simulator running?"
            ) from None
        if os.fstat(self._file).st_size < _ALIGN or os.pread(self._file, 4, 0) != _MAGIC:
            os.close(self._file)
            raise RingError(f"shm:{name}: that shared memory is no ring of frames")
        self._memory: mmap.mmap | None = mmap.mmap(self._file, 0, access=mmap.ACCESS_READ)
        _, kind, encoding, self.slots, height, width = _HEADER.unpack_from(self._memory, 0)
        self.what = Format(Kind(kind), Encoding(encoding.rstrip(b"\0").decode()), height, width)
        self._written, self._heads = _views(self._memory, self.what, self.slots)
        self.lost = 0
        """Samples that were overwritten before `read` came to them."""
        self._next = max(0, self.written - self.slots)

    @property
    def written(self) -> int:
        """How many samples the writer has published."""
        return int(self._written[0])

    @property
    def ended(self) -> bool:
        """No more will come, and all is read: the writer has closed the ring, or has died."""
        if self._memory is None:
            return True
        gone = self._memory[_CLOSED_AT] == 1 or _is_free(self._file)
        return gone and self._next >= self.written

    def read(self) -> Sample | None:
        """The oldest sample not read yet; None when there is none now."""
        while self.written > self._next:
            number = max(self._next, self.written - self.slots)
            self.lost += number - self._next
            self._next = number + 1
            sample = self.at(number)
            if sample is not None:
                return sample
            self.lost += 1
        return None

    def newest(self) -> Sample | None:
        """The sample written last, those before it left out; None when it was read already, or there is none."""
        while self.written > self._next:
            self._next = self.written
            sample = self.at(self._next - 1)
            if sample is not None:
                return sample
        return None

    def at(self, number: int) -> Sample | None:
        """A copy of the sample of that number; None when it was overwritten or is not there yet."""
        if self._memory is None or number < 0:
            return None
        slot = number % self.slots
        head = self._heads[slot]
        if head[_NUMBER] != number:
            return None
        time_us, rows = int(head[_TIME]), int(head[_ROWS])
        copy = _data(self._memory, self.what, slot, min(rows, self.what.height)).copy()
        return Sample(number, time_us, copy) if head[_NUMBER] == number else None

    def close(self) -> None:
        """Let the ring go; may be called twice."""
        if self._memory is not None:
            self._written, self._heads = self._written.copy(), self._heads.copy()
            self._memory = None
            os.close(self._file)


Words = npt.NDArray[np.uint64]


def _views(memory: mmap.mmap, what: Format, slots: int) -> tuple[Words, Words]:
    """The number of samples (1,), and the heads of all slots (slots, 3)."""
    heads = np.ndarray((slots, 3), np.uint64, memory, _ALIGN, (what.slot_size, 8))
    return np.frombuffer(memory, np.uint64, 1, _COUNT_AT), heads


def _data(memory: mmap.mmap, what: Format, slot: int, rows: int) -> Array:
    shape = (rows, *what.shape[1:])
    return np.ndarray(shape, what.encoding.dtype, memory, _ALIGN + slot * what.slot_size + _SLOT_HEAD)


def remove_if_left(name: str) -> bool:
    """Remove a ring whose writer has died without removing it; whether there is none of that name any more."""
    try:
        file = os.open(FOLDER / name, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return True
    try:
        left = _is_free(file)
        if left:
            (FOLDER / name).unlink(missing_ok=True)
        return left
    finally:
        os.close(file)


def _is_free(file: int) -> bool:
    """Whether no writer holds a ring's lock."""
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    fcntl.flock(file, fcntl.LOCK_UN)
    return True
