"""ROS 2, by DDS, on a domain of the test's own that nobody outside this machine hears of.

The other side is `rclpy_stand_in`, or a participant of Cyclone DDS's: its code writes and reads the messages, not ours.
"""

import contextlib
import functools
import itertools
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests import dds
from tests.launched import launched
from tests.unit.test_dds_service import Client

pytest.importorskip("cyclonedds", reason="needs the extra ros2")

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from sitl_emu.run import dds_types
from sitl_emu.run.ros.publisher import CLOCK, described

ROOT = Path(__file__).parents[2]
YARD = ROOT / "examples" / "own_world" / "yard.yaml"
STAND_IN = Path(__file__).parent / "rclpy_stand_in"
INSTANCE = 70
DOMAIN = dds.domain()
LIMIT_S = 240.0
until = functools.partial(dds.until, limit_s=LIMIT_S)
OFFBOARD = 14
NEWEST = Qos(Policy.Reliability.BestEffort, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))


@pytest.fixture(autouse=True)
def loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", dds.LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))


def hearing(topic: str, message: str) -> Callable[[], Any]:
    """The newest message of a topic, or None before there is one."""
    participant = DomainParticipant(DOMAIN)
    reader = DataReader(participant, Topic(participant, topic, dds_types.described(message)), qos=NEWEST)
    newest: list[Any] = [None]

    def hear() -> Any:
        newest[-1:] = (newest + reader.take(10))[-1:]
        return newest[-1]

    return hear


@contextlib.contextmanager
def example() -> Iterator[subprocess.Popen[str]]:
    """The example in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(STAND_IN), str(ROOT)))}
    command = [sys.executable, str(ROOT / "examples" / "ros2_offboard.py"), f"px4_{INSTANCE}"]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def test_the_example_flies_a_square_and_lands() -> None:
    with launched("iris", "--dds", "--instance", str(INSTANCE)), example() as node:
        said, _ = node.communicate(timeout=LIMIT_S)
        assert node.returncode == 0
    assert said.splitlines() == [*(f"corner {corner} of 5" for corner in range(1, 6)), "landed"]


def test_a_node_that_dies_ends_offboard() -> None:
    with launched("iris", "--dds", "--instance", str(INSTANCE)), example() as node:
        status = hearing(f"rt/px4_{INSTANCE}/fmu/out/vehicle_status_v4", "VehicleStatus")
        assert node.stdout is not None
        assert node.stdout.readline() == "corner 1 of 5\n"
        until(lambda: status() is not None and status().nav_state == OFFBOARD)
        node.kill()
        until(lambda: bool(status().failsafe) and status().nav_state != OFFBOARD)


def test_at_another_speed_all_bear_simulated_time_and_clock_tells_it() -> None:
    """A node with use_sim_time: sensors are 4 ms apart by their stamps, and of the time that /clock tells."""
    sensors = DomainParticipant(DOMAIN)
    topic = Topic(sensors, f"rt/px4_{INSTANCE + 1}/fmu/out/sensor_combined", dds_types.described("SensorCombined"))
    reader = DataReader(sensors, topic, qos=NEWEST + Qos(Policy.History.KeepAll))
    told = DataReader(sensors, Topic(sensors, "rt/clock", described("rosgraph_msgs/Clock")), qos=CLOCK)
    began_us, clock_us, stamps_us = time.time_ns() // 1000, list[int](), list[int]()

    def listen() -> bool:
        for each in told.take(10):
            clock_us.append(each.clock.sec * 1_000_000 + each.clock.nanosec // 1000)
        for each in reader.take(1000):
            stamps_us.append(each.timestamp)
        return len(stamps_us) > 3000

    with launched("iris:2", "--world", str(YARD), "--dds", "--speed", "4", "--instance", str(INSTANCE)):
        until(listen)
    assert clock_us == sorted(set(clock_us)) and stamps_us == sorted(set(stamps_us))
    assert all((later - earlier) % 4000 == 0 for earlier, later in itertools.pairwise(stamps_us))
    assert abs(clock_us[-1] - stamps_us[-1]) < 3_000_000
    assert 0 < clock_us[0] - began_us < 600_000_000


def test_the_service_answers_by_what_the_vehicle_says() -> None:
    with launched("iris", "--dds", "--instance", str(INSTANCE)):
        client = Client(DomainParticipant(DOMAIN), 1, within=f"px4_{INSTANCE}")
        until(lambda: bool(client.writer.get_matched_subscriptions() and client.reader.get_matched_publications()))
        replies = list[Any]()
        for sequence, target in ((1, 1), (2, INSTANCE + 1)):  # the first is for another system
            client.ask(sequence, command=31000, target_system=target)
        while not replies:
            replies += client.replies()
            time.sleep(0.01)
    (reply,) = replies
    assert (reply.seq, reply.reply.command, reply.reply.result) == (2, 31000, 3)
    assert abs(time.time() - reply.reply.timestamp * 1e-6) < 60.0
