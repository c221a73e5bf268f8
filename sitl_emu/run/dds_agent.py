"""The DDS agent of some autopilots: a participant for each, with PX4's topics under the names that ROS 2 knows.

    python -P -m sitl_emu.run.dds_agent DOMAIN INSTANCE:FD …

FD is the agent's end of an autopilot's `dds_socket`, INSTANCE gives the namespace. Samples pass as they are: who made
them has told their times. It ends when all autopilots have gone. Cyclone DDS's own settings (CYCLONEDDS_URI) hold.
"""

import selectors
import signal
import socket
import sys
import threading
from typing import Any

from cyclonedds.core import DDSException, InstanceState, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from sitl_emu.autopilot.uxrce_dds_client import cdr, dds_topics
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import (
    MESSAGES,
    PUBLICATIONS,
    REPLY,
    REQUEST,
    SUBSCRIPTIONS,
    VEHICLE_COMMAND,
    Sample,
)
from sitl_emu.run import dds_types
from sitl_emu.run.dds_service import OfferedService
from sitl_emu.run.dds_socket import CLOCK, LARGEST_PACKET_BYTES, TIME, namespace, packet, samples
from sitl_emu.run.dds_types import PLAIN_CDR
from sitl_emu.run.ros.messages import stamp
from sitl_emu.run.ros.publisher import CLOCK as CLOCK_QOS
from sitl_emu.run.ros.publisher import Publisher

WRITER = Qos(Policy.Reliability.BestEffort, Policy.Durability.TransientLocal, Policy.History.KeepLast(1), PLAIN_CDR)
"""PX4's writers (utilities.hpp, create_data_writer)."""
ANY = SampleState.Any | ViewState.Any | InstanceState.Any
LOOK_S = 0.5
"""How often the thread that waits for ROS 2 looks whether it is still wanted."""


def depth(topic: dds_topics.Topic) -> int:
    """Samples that PX4's reader of a topic keeps: what uORB's queues hold, but twice that of a single one."""
    return MESSAGES[topic.type].queue * (topic.instances if topic.instances > 1 else 2)


def reader_qos(topic: dds_topics.Topic) -> Qos:
    """PX4's readers (create_data_reader)."""
    return Qos(
        Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(depth(topic)), PLAIN_CDR
    )


class Clock:
    """/clock, as some vehicles tell it: it never goes back, and begins with the first that does."""

    def __init__(self, participant: DomainParticipant) -> None:
        self._participant = participant
        self._publisher: Publisher | None = None
        self._told_us = 0

    def tell(self, time_us: int) -> None:
        """The time at one of the vehicles, since 1970."""
        if self._publisher is None:
            self._publisher = Publisher(self._participant, "clock", "rosgraph_msgs/Clock", CLOCK_QOS)
        if time_us > self._told_us:
            self._told_us = time_us
            self._publisher.publish({"clock": stamp(time_us)})


class Vehicle:
    """One autopilot's side of DDS."""

    def __init__(self, participant: DomainParticipant, instance: int, opened: socket.socket, clock: Clock) -> None:
        self._socket, self._clock = opened, clock
        within = namespace(instance)
        self._kinds = [dds_types.carried(topic.type) for topic in PUBLICATIONS]
        self._writers = [
            DataWriter(participant, Topic(participant, dds_topics.dds_name(topic, "out", within), kind), qos=WRITER)
            for topic, kind in zip(PUBLICATIONS, self._kinds, strict=True)
        ]
        self._readers = [
            DataReader(
                participant,
                Topic(participant, dds_topics.dds_name(topic, "in", within), dds_types.carried(topic.type)),
                qos=reader_qos(topic),
            )
            for topic in SUBSCRIPTIONS
        ]
        self._service = OfferedService(participant, VEHICLE_COMMAND, within)
        self._wait = WaitSet(participant)
        for reader in (*self._readers, self._service.requests):
            self._wait.attach(ReadCondition(reader, ANY))
        self._wait.attach(self._service.requests)
        self._over = False
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def publish(self) -> bool:
        """Write what the autopilot has sent; False when it has gone."""
        try:
            data = self._socket.recv(LARGEST_PACKET_BYTES)
        except ConnectionError:
            return False
        for topic, message in samples(data):
            if topic == REPLY:
                self._service.reply(message)
            elif topic == CLOCK:
                self._clock.tell(*TIME.unpack(message))
            else:
                self._writers[topic].write(dds_types.sample(self._kinds[topic], message))
        return bool(data)

    def close(self) -> None:
        """Leave DDS."""
        self._over = True
        self._thread.join()
        self._socket.close()

    def _listen(self) -> None:
        while not self._over:
            try:
                self._wait.wait(duration(seconds=LOOK_S))
                taken = [sample for number, reader in enumerate(self._readers) for sample in _take(number, reader)]
                taken += [Sample(REQUEST, data) for data in self._service.take()]
                if taken:
                    self._socket.send(packet(taken))
            except ConnectionError:
                return


def _take(number: int, reader: DataReader[Any]) -> list[Sample]:
    """What came on a topic, whole messages alone: those of another layout or byte order are not for PX4."""
    topic = SUBSCRIPTIONS[number]
    length = cdr.size(topic.type)
    return [
        Sample(number, each.data[len(cdr.HEADER) :][:length])
        for each in reader.take(depth(topic))
        if isinstance(each, dds_types.Carried)
        and each.data[:2] == cdr.HEADER[:2]
        and len(each.data) >= len(cdr.HEADER) + length
    ]


def main() -> int:
    """Serve until all autopilots have gone; the exit status."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    domain, vehicles = int(sys.argv[1]), dict[int, Vehicle]()
    clock: Clock | None = None
    selector = selectors.DefaultSelector()
    try:
        for text in sys.argv[2:]:
            instance, fd = (int(part) for part in text.split(":"))
            opened = socket.socket(fileno=fd)
            participant = DomainParticipant(domain)
            clock = clock or Clock(participant)
            vehicles[fd] = Vehicle(participant, instance, opened, clock)
            selector.register(fd, selectors.EVENT_READ)
    except DDSException as error:
        print(f"sitl-emu: DDS domain {domain}: {error}", file=sys.stderr)
        return 1
    while vehicles:
        for key, _ in selector.select():
            if not vehicles[key.fd].publish():
                selector.unregister(key.fd)
                vehicles.pop(key.fd).close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
