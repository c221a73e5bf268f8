"""Depth images and point clouds, as a companion reads them: `open_feed("shm:NAME")`.

In a run a scenario's `depth:` and `lidar:` are such feeds, and a companion of ours is handed what arrives
(`companion.SeesRanges`); a command is told their names by the words {depth} and {lidar}. On an aircraft whatever
writes such a ring, a sensor's driver, takes the simulator's place. A feed of images is a camera's (`camera.py`).
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.core.frame_ring import Encoding, Kind, RingError, RingReader, Sample

MILLIMETRES_PER_METRE = np.float32(1000.0)
Metres = npt.NDArray[np.float32]


class FeedError(Exception):
    """A feed that can't be opened; the text is one line for people."""


class Depth(NamedTuple):
    """A depth image, with the vehicle's boot time at which it was taken. `index` counts from 0 within its feed."""

    time_usec: int
    depth_m: Metres
    """(height, width), along the optical axis; inf where nothing was near enough (ROS REP 118)."""
    index: int  # type: ignore[assignment]  # hides tuple.index, which no frame needs


class Cloud(NamedTuple):
    """The points of one scan, with the vehicle's boot time at which it was taken."""

    time_usec: int
    points_m: Metres
    """(n, 3), in the vehicle's body axes (forward, right, down) from its origin."""
    index: int  # type: ignore[assignment]


Ranges = Depth | Cloud


class Feed:
    """Reads one feed."""

    def __init__(self, name: str) -> None:
        """Raises FeedError when there is no such feed, or one that carries images."""
        try:
            self._ring = RingReader(name)
        except RingError as error:
            raise FeedError(str(error)) from None
        if self._ring.what.kind is Kind.IMAGE:
            self.close()
            raise FeedError(f"shm:{name}: that feed carries images: it is a camera's")

    @property
    def ended(self) -> bool:
        """Whether its writer has gone, and all is read."""
        return self._ring.ended

    @property
    def lost(self) -> int:
        """How many were overwritten before they were read."""
        return self._ring.lost

    def read(self) -> Ranges | None:
        """The oldest not read yet; None when there is none now."""
        return self._ranges(self._ring.read())

    def newest(self) -> Ranges | None:
        """The newest, those before it left out; None when there is none that was not read."""
        return self._ranges(self._ring.newest())

    def at(self, index: int) -> Ranges | None:
        """The one of that index; None when it was overwritten or is not there yet."""
        return self._ranges(self._ring.at(index))

    def close(self) -> None:
        """Lets the ring go."""
        self._ring.close()

    def _ranges(self, sample: Sample | None) -> Ranges | None:
        if sample is None:
            return None
        what, data = self._ring.what, sample.data
        if what.kind is Kind.POINTS:
            return Cloud(sample.time_us, data, sample.number)
        if what.encoding is Encoding.MM16:
            data = np.where(data == 0, np.float32(np.inf), data / MILLIMETRES_PER_METRE).astype(np.float32)
        return Depth(sample.time_us, data, sample.number)


def open_feed(url: str) -> Feed:
    """Opens a feed of depth images or point clouds, `shm:NAME`. Raises FeedError."""
    if not url.startswith("shm:"):
        raise FeedError(f"{url}: no feed of depth images or points; allowed: shm:NAME")
    return Feed(url.removeprefix("shm:"))
