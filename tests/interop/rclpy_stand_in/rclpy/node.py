"""What of rclpy.node the example uses."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from rclpy.qos import QoSProfile, profile

ANY = SampleState.Any | ViewState.Any | InstanceState.Any


@dataclass
class Timer:
    """Runs at a period."""

    period_s: float
    function: Callable[[], None]
    due_s: float

    def run(self, now_s: float) -> None:
        """If it is due."""
        if now_s >= self.due_s:
            self.due_s = max(self.due_s + self.period_s, now_s)
            self.function()


class Now:
    """The system's time."""

    nanoseconds = property(lambda _self: time.time_ns())

    def now(self) -> "Now":
        """As of a clock."""
        return self


class Publisher:
    """Of a topic."""

    def __init__(self, writer: DataWriter[Any]) -> None:
        self.publish = writer.write


class Node:
    """A participant, whose topics bear the names that rmw gives them."""

    def __init__(self, name: str) -> None:
        self._participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
        self._waiting = WaitSet(self._participant)
        self._heard: list[tuple[DataReader[Any], Callable[[Any], None]]] = []
        self.timers: list[Timer] = []

    def create_publisher(self, message: type, topic: str, qos: QoSProfile | int) -> Publisher:
        """As in rclpy."""
        quality = profile(qos).dds()
        return Publisher(DataWriter(self._participant, Topic(self._participant, f"rt{topic}", message), qos=quality))

    def create_subscription(self, message: type, topic: str, function: Callable[[Any], None], qos: QoSProfile) -> None:
        """As in rclpy."""
        reader = DataReader(self._participant, Topic(self._participant, f"rt{topic}", message), qos=qos.dds())
        self._heard.append((reader, function))
        self._waiting.attach(ReadCondition(reader, ANY))

    def wait(self, timeout_s: float) -> None:
        """Until a message has come, at most so long."""
        self._waiting.wait(duration(seconds=timeout_s))

    def create_timer(self, period_s: float, function: Callable[[], None]) -> None:
        """As in rclpy."""
        self.timers.append(Timer(period_s, function, time.monotonic()))

    def get_clock(self) -> Now:
        """As in rclpy."""
        return Now()

    def hear(self) -> None:
        """Call who subscribed to what has come."""
        for reader, function in self._heard:
            for sample in reader.take(100):
                if not isinstance(sample, InvalidSample):
                    function(sample)

    def destroy_node(self) -> None:
        """As in rclpy."""
