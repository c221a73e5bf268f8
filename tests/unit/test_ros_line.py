"""What a launch tells the process that publishes its world to ROS 2. That process is a fake; the vehicle is real."""

import itertools
import socket
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.core.simulator_api import CameraZoom, DistanceSensor
from sitl_emu.run import cameras, ros_line, site
from sitl_emu.run.children import Child
from sitl_emu.run.configs import RosConfig, RosVehicleData
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.messages import FrameTaken, RangeSeen, Ready, Seen, Start
from sitl_emu.run.ros_line import EVERY_US, Dates, RosLine
from sitl_emu.world.home import Home
from sitl_emu.world.simulation import Simulation

START_US = 1_700_000_000_000_000
TICK_US = 4000
LEVEL = (1.0, 0.0, 0.0, 0.0)


class FakePhotographer:
    """Has the frames that it is given."""

    def __init__(self) -> None:
        self.frames: list[tuple[int, FrameTaken]] = []
        self.gimbals: dict[int, Any] = {}
        self.zooms = {0: CameraZoom(40.0)}
        self.forgotten = False

    def forget_frames(self) -> None:
        self.forgotten = True


def photographer() -> Any:
    return FakePhotographer()


class Bench:
    """An m600, ticked; `time_0_us` is the date of its time 0."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, process: Any = None) -> None:
        """`process`: that of ROS 2, if not one that was killed."""

        def start(title: str, module: str, config: RosConfig, end: socket.socket, _folder: Path) -> Any:
            assert module == "ros_process"
            self.config, self.ros = config, ControlChannel(end.dup(), title)
            (folder / "log").write_text("")
            ended: Any = SimpleNamespace(pid=7, returncode=-9, wait=lambda _limit_s: None, poll=lambda: -9)
            return Child(title, process or ended, folder / "log")

        monkeypatch.setattr(ros_line, "start_process", start)
        data = vehicles.load("m600")
        self.simulation = Simulation([site.plain(Home(47.4, 8.5, 490.0, 0.0), 1).simulator(data, 0, "m600-0")])
        self.photographer = photographer()
        self.said: list[str] = []
        self.time_0_us: int | None = START_US
        told = RosVehicleData(
            name="m600-0", instance=0, range_finder=True, camera=cameras.of_data(data), rings={"camera": "none"}
        )
        self.line = RosLine(
            [told], self.simulation, self.photographer, START_US, lambda: self.time_0_us, self.said.append
        )

    def tick(self, many: int, *sensed: DistanceSensor) -> None:
        """As a fleet does, from waking to waking."""
        for place in range(many):
            self.simulation.tick([None])
            self.line.sensed([sensed])
            if place % 2:
                self.line.tell()

    def heard(self) -> list[Seen]:
        heard = list[Seen]()
        while (message := self.ros.poll()) is not None:
            assert isinstance(message, Seen)
            heard.append(message)
        return heard


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    made = Bench(tmp_path, monkeypatch)
    assert made.ros.expect(Start)
    made.line.begin()
    made.tick(10)
    assert made.heard() == [], "it is not ready"
    made.ros.send(Ready())
    made.line.begin()
    yield made
    made.line.close()
    made.ros.close()


def test_it_is_told_of_the_vehicles_fifty_times_a_second(bench: Bench) -> None:
    assert not bench.config.tells_clock and bench.config.start_us == START_US
    bench.tick(250)
    heard = bench.heard()
    assert len(heard) == pytest.approx(50, abs=1)
    assert all(each.now_us % TICK_US == 0 for each in heard)
    (seen,) = heard[-1].vehicles
    pose = bench.simulation.simulators[0].pose()
    assert seen.pose.down_m == pytest.approx(pose.down_m, abs=0.01)
    assert seen.head is not None and seen.zoom_percent == 40.0


def test_all_times_follow_the_clock_that_px4_s_topics_follow(bench: Bench) -> None:
    bench.tick(10)
    bench.heard()
    bench.time_0_us = START_US + 300_000
    bench.tick(6)
    (told,) = bench.heard()
    assert told.now_us == bench.simulation.simulators[0].time_usec + 300_000
    now_ms = bench.simulation.simulators[0].time_usec // 1000
    bench.photographer.frames.append((0, FrameTaken("camera", 5, 1000 * now_ms)))
    bench.tick(6, DistanceSensor(now_ms, 10, 4000, 1234, 0, 0, 25, 4, 0.0, 0.0, LEVEL, 100))
    (told,) = bench.heard()
    (seen,) = told.vehicles
    assert seen.frames == (FrameTaken("camera", 5, 1000 * now_ms + 300_000),)
    assert seen.distance == RangeSeen(1000 * now_ms + 300_000, 12.34, 0.1, 40.0, 0.0, 4e-4)
    bench.time_0_us = None
    bench.tick(20)
    assert bench.heard() == [], "while it reboots the date is not known"


def test_no_time_goes_back_where_px4_s_does(bench: Bench) -> None:
    """A machine that can't follow: PX4's clock jumps, back as well; frames that come late are between the others."""
    bench.tick(10)
    bench.heard()
    jumps_us = (0, 150_000, -40_000, 90_000, -110_000, -400_000, 0, 0)
    for place, jump_us in enumerate(jumps_us):
        bench.time_0_us = START_US + jump_us
        for _ in range(4):
            late_us = bench.simulation.simulators[0].time_usec - 8_000 * (place % 3)
            bench.photographer.frames.append((0, FrameTaken("camera", place, late_us)))
            bench.tick(10)
    heard = bench.heard()
    assert len(heard) > 50
    for times_us in (
        [each.now_us for each in heard],
        [frame.time_us for each in heard for frame in each.vehicles[0].frames],
    ):
        assert all(later > earlier for earlier, later in itertools.pairwise(times_us))
    assert heard[-1].now_us == bench.simulation.simulators[0].time_usec - EVERY_US + 20_000, "it is caught up with"


def test_dates_between_two_tellings_go_evenly() -> None:
    dates = Dates()
    dates.follow(20_000, 1_020_000)
    dates.follow(40_000, 1_080_000)
    dates.follow(60_000, 900_000)
    told = [dates.told_us(time_us) for time_us in (16_000, 20_000, 24_000, 40_000, 44_000, 60_000, 64_000)]
    assert told == [1_016_000, 1_020_000, 1_032_000, 1_080_000, 1_080_200, 1_081_000, 1_085_000]


def test_a_frame_of_before_the_asked_speed_is_left_out(bench: Bench) -> None:
    bench.tick(1)
    bench.line.begin()
    bench.photographer.frames += [(0, FrameTaken("camera", 0, 40_000)), (0, FrameTaken("camera", 1, 44_000))]
    bench.tick(10)
    assert [frame.index for each in bench.heard() for frame in each.vehicles[0].frames] == [1]
    assert bench.photographer.frames == []


def test_nobody_waits_where_it_does_not_follow(bench: Bench) -> None:
    bench.tick(25_000)
    assert 0 < len(bench.heard()) < 5000
    bench.tick(250)
    assert len(bench.heard()) == pytest.approx(50, abs=1)
    assert bench.said == []


def test_when_it_has_died_that_is_told_once_and_nothing_is_drawn_for_it(bench: Bench) -> None:
    bench.ros.close()
    bench.tick(100)
    (said,) = bench.said
    assert said.startswith("ROS 2 hears nothing of the world any more: ros (pid 7) was killed by SIGKILL")
    assert bench.photographer.forgotten
