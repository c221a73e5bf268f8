"""What a launch asks its depth cameras and lidars for. Their processes are fakes; world and vehicles are real."""

import dataclasses
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.core.simulator_api import GimbalState
from sitl_emu.run import range_feeds, site
from sitl_emu.run.children import Child
from sitl_emu.run.configs import RangeConfig, RosVehicleData
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.messages import End, FrameTaken, Message, Ready, Render, Rendered
from sitl_emu.run.range_feeds import RangeFeeds, of_data
from sitl_emu.vehicles import VehicleError
from sitl_emu.world.simulation import Simulation

YARD = Path(__file__).parents[2] / "examples/own_world/yard.yaml"
M600 = vehicles.load("m600")
DATA = dataclasses.replace(M600, depth={"mount": "gimbal", "reach_m": 6.0}, lidar={"rows": 1, "rate_hz": 10.0})
HEAD = (0.0, 1.0, 0.0, 0.0)


class Bench:
    """An m600 with both, and beside it a rover with none."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, process: Any = None) -> None:
        """`process`: of each feed, if not one that was killed."""
        self.configs: list[RangeConfig] = []
        self.theirs: list[ControlChannel] = []
        (folder / "log").write_text("")

        def start(title: str, module: str, config: RangeConfig, end: socket.socket, _folder: Path) -> Any:
            assert module == "range_process"
            self.configs.append(config)
            self.theirs.append(ControlChannel(end.dup(), title))
            ended: Any = SimpleNamespace(pid=7, returncode=-9, wait=lambda _limit_s=None: -9, poll=lambda: -9)
            return Child(title, process or ended, folder / "log")

        monkeypatch.setattr(range_feeds, "start_process", start)
        here = site.in_world(str(YARD), 1, print)
        assert here.world is not None
        simulators = [
            here.simulator(data, 3.0 * place, f"{data.model}-{place}")
            for place, data in enumerate((vehicles.load("rover"), M600))
        ]
        self.simulation = Simulation(simulators, here.solids, here.areas)
        depth, lidar = of_data(DATA)
        rings = {feed: f"sitl_emu-test-{os.getpid()}-{feed}" for feed in ("depth", "lidar")}
        told = [
            RosVehicleData(name="rover-0", instance=0, range_finder=False, rings={}),
            RosVehicleData(name="m600-1", instance=1, range_finder=True, depth=depth, lidar=lidar, rings=rings),
        ]
        self.feeds = RangeFeeds(told, ["rover", "m600"], self.simulation, here.world, here.seed)

    def heard(self, feed: int) -> list[Message]:
        heard = list[Message]()
        while (message := self.theirs[feed].poll()) is not None:
            heard.append(message)
        return heard

    def ask(self, now_us: int) -> list[Message]:
        self.feeds.ask(now_us, {1: GimbalState(HEAD)})
        return [message for feed in range(2) for message in self.heard(feed)]


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    made = Bench(tmp_path, monkeypatch)
    yield made
    made.feeds.close()
    for each in made.theirs:
        each.close()


def test_each_has_a_process_that_tells_no_autopilot(bench: Bench) -> None:
    depth, lidar = bench.configs
    assert depth.depth is not None and depth.depth.reach_m == 6.0 and depth.lidar is None
    assert lidar.lidar is not None and lidar.lidar.rows == 1 and lidar.depth is None
    for each in bench.configs:
        assert (each.name, each.tells_obstacles) == ("m600-1", False)
        assert Path(each.world).is_file()


def test_a_frame_is_asked_for_when_it_is_due_and_the_one_before_is_done(bench: Bench) -> None:
    assert bench.ask(1_000_000) == [], "they are being set up"
    for each in bench.theirs:
        each.send(Ready())
    assert bench.feeds.measured() == []
    depth, lidar = bench.ask(1_020_000)
    assert isinstance(depth, Render) and isinstance(lidar, Render)
    assert (depth.index, depth.time_us, lidar.index, lidar.time_us) == (0, 1_020_000, 0, 1_020_000)
    pose = bench.simulation.simulators[1].pose()
    assert depth.pose == lidar.pose == (pose.north_m, pose.east_m, pose.down_m, pose.q)
    assert depth.head is not None and lidar.head is None, "one is on the gimbal"
    ((name, model, where, _),) = lidar.others
    rover = bench.simulation.simulators[0].pose()
    assert (name, model, where) == ("rover-0", "rover", (rover.north_m, rover.east_m, rover.down_m, rover.q))
    bench.theirs[1].send(Rendered(0))
    assert bench.feeds.measured() == [(1, FrameTaken("lidar", 0, 1_020_000))]
    assert bench.ask(1_100_000) == [], "the lidar's is not due; the depth camera is at work"
    (lidar,) = bench.ask(1_120_000)
    assert isinstance(lidar, Render) and lidar.index == 1
    bench.theirs[0].send(Rendered(0))
    assert bench.feeds.measured() == [(1, FrameTaken("depth", 0, 1_020_000))]
    (depth,) = bench.ask(1_220_000)
    assert isinstance(depth, Render) and depth.index == 1


def test_one_that_has_died_is_told_of_and_the_other_goes_on(bench: Bench) -> None:
    bench.theirs[1].send(Ready())
    bench.theirs[0].close()
    assert bench.feeds.measured() == []
    (told,) = bench.feeds.complaints
    assert told.startswith("ROS 2 hears it no more: depth m600-1 (pid 7) was killed by SIGKILL")
    bench.feeds.ask(20_000, {})
    (asked,) = bench.heard(1)
    assert isinstance(asked, Render)
    bench.feeds.close()
    assert bench.theirs[1].poll() == End()


def test_figures_that_cannot_be_are_named() -> None:
    assert of_data(M600) == (None, None)
    with pytest.raises(VehicleError, match=r"m600/vehicle.toml: lidar.rows: "):
        of_data(dataclasses.replace(M600, lidar={"rows": 0}))
    iris = dataclasses.replace(vehicles.load("iris"), depth={"mount": "gimbal"})
    with pytest.raises(VehicleError, match=r"iris/vehicle.toml: depth.mount: "):
        of_data(iris)
