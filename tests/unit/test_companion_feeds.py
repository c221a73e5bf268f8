"""Depth images and point clouds as a companion gets them: from shared memory, and through its harness."""

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from sitl_emu.core.frame_ring import Encoding, Format, Kind, RingWriter
from sitl_emu.missions.companion.companion import Outgoing, Status
from sitl_emu.missions.companion.feeds import Cloud, Depth, FeedError, open_feed
from sitl_emu.missions.companion.harness import Harness
from sitl_emu.missions.companion.inference import Inference
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.companion.scripted import Scripted
from sitl_emu.run.companion_process import Feeds
from sitl_emu.run.messages import FrameTaken
from tests.typed import now

DEPTH = Format(Kind.DEPTH, Encoding.M32, 2, 3)
CLOUD = Format(Kind.POINTS, Encoding.XYZ32, 5)
IMAGE = Format(Kind.IMAGE, Encoding.BGR8, 2, 3)


@pytest.fixture
def rings() -> Iterator[dict[str, RingWriter]]:
    """A feed of each kind."""
    formats = {"camera": IMAGE, "depth": DEPTH, "lidar": CLOUD}
    made = {feed: RingWriter(f"sitl_emu_feeds_{os.getpid()}_{feed}", what, 4) for feed, what in formats.items()}
    yield made
    for ring in made.values():
        ring.close()


def points(*north_m: float) -> "np.ndarray[Any, np.dtype[np.float32]]":
    return np.array([(each, 0.0, 0.0) for each in north_m], np.float32).reshape(-1, 3)


def test_depth_and_clouds_come_with_their_times(rings: dict[str, RingWriter]) -> None:
    depth, lidar = open_feed(f"shm:{rings['depth'].name}"), open_feed(f"shm:{rings['lidar'].name}")
    assert depth.read() is None and lidar.newest() is None
    rings["depth"].write(100, np.full((2, 3), 4.5, np.float32))
    rings["lidar"].write(50, points())
    rings["lidar"].write(150, points(1.0, 2.0))
    seen, empty, scan = depth.read(), lidar.read(), lidar.newest()
    assert isinstance(seen, Depth) and seen.time_usec == 100 and np.all(seen.depth_m == 4.5)
    assert isinstance(empty, Cloud) and empty.points_m.shape == (0, 3)
    assert isinstance(scan, Cloud) and scan.time_usec == 150 and np.array_equal(scan.points_m, points(1.0, 2.0))
    assert not now(depth.ended)
    rings["depth"].close()
    assert now(depth.ended)
    depth.close()
    lidar.close()


def test_millimetres_become_metres_and_nothing_becomes_infinity() -> None:
    ring = RingWriter(f"sitl_emu_mm_{os.getpid()}", Format(Kind.DEPTH, Encoding.MM16, 1, 3))
    feed = open_feed(f"shm:{ring.name}")
    ring.write(1, np.array([[0, 1, 12_345]], np.uint16))
    seen = feed.read()
    assert isinstance(seen, Depth) and seen.depth_m.dtype == np.float32
    assert seen.depth_m.tolist() == [[np.inf, pytest.approx(0.001), pytest.approx(12.345)]]
    feed.close()
    ring.close()


def test_what_is_no_such_feed_is_told(rings: dict[str, RingWriter]) -> None:
    with pytest.raises(FeedError, match="that feed carries images: it is a camera's"):
        open_feed(f"shm:{rings['camera'].name}")
    with pytest.raises(FeedError, match="is the simulator running"):
        open_feed("shm:nothing_here")
    with pytest.raises(FeedError, match=r"/dev/video0: no feed of depth images or points; allowed: shm:NAME"):
        open_feed("/dev/video0")


def test_a_companion_in_a_run_is_handed_what_it_is_told_of_and_losses_are_counted(rings: dict[str, RingWriter]) -> None:
    feeds = Feeds({feed: ring.name for feed, ring in rings.items()})
    for index in range(6):
        rings["lidar"].write(10 * index, points(float(index)))
    rings["depth"].write(7, np.ones((2, 3), np.float32))
    rings["camera"].write(8, np.ones((2, 3, 3), np.uint8))
    told = [
        FrameTaken("lidar", 1, 10),
        FrameTaken("lidar", 5, 50),
        FrameTaken("depth", 0, 7),
        FrameTaken("camera", 0, 8),
    ]
    assert [(type(one), one.time_usec) for one in feeds.ranges(told)] == [(Cloud, 50), (Depth, 7)]
    assert [frame.time_usec for frame in feeds.images(told)] == [8]
    assert feeds.lost == 1, "scan 1 of 4 slots was overwritten"
    assert not feeds.ranges([]) and not feeds.images([])
    feeds.close()


def test_a_script_finds_the_newest_on_board() -> None:
    seen = list[tuple[int | None, int | None]]()

    def look(onboard: Onboard) -> Script:
        while True:
            depth, cloud = onboard.depth, onboard.cloud
            seen.append((depth and depth.index, cloud and cloud.index))
            yield

    companion = Scripted(look)
    harness = Harness(companion, {}, Inference(companion.detect, most_waiting=None))
    depth = [Depth(index, np.zeros((1, 1), np.float32), index) for index in (3, 4)]
    harness.step(0, [])
    harness.step(1, [], [], [depth[0], Cloud(5, points(), 9), depth[1]])
    harness.step(2, [])
    harness.close()
    assert seen == [(None, None), (4, 9), (4, 9)]


class Blind:
    """A companion that wants no ranges."""

    system_id, status = 1, Status("", 0.0, False, "", "")

    def on_time(self, now_us: int) -> Outgoing:
        return []

    def events(self) -> list[Any]:
        return []


def test_a_companion_that_sees_no_ranges_is_not_given_any() -> None:
    blind: Any = Blind()
    harness = Harness(blind, {}, Inference(lambda *_: (), most_waiting=None))
    assert harness.step(0, [], [], [Cloud(5, points(), 9)]) == []
    harness.close()
