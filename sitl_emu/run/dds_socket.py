"""How autopilots reach DDS: sockets to an agent, a process of its own, so that no tick waits for it.

A packet holds samples, each behind a header: the number of its topic, the bytes of its data. What the agent can't take
in time is lost, as on the wire to any other agent of PX4's client (best effort).
"""

import importlib.util
import os
import socket
import struct
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence

from sitl_emu.autopilot.uxrce_dds_client import dds_topics
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import REPLY, Sample
from sitl_emu.run.trouble import Trouble

HEADER = struct.Struct("<HH")
LARGEST_PACKET_BYTES = 1 << 16
BUFFER_BYTES = 1 << 20
CLOCK = REPLY + 1
"""Number of the sample that is no message of PX4's: the time for /clock, µs since 1970."""
TIME = struct.Struct("<Q")
AT_ONCE = 32
"""Packets that are taken before it is another's turn, or time for a tick: a flood must not stop time."""
NAMESPACE = "PX4_UXRCE_DDS_NS"
"""Of the environment; empty: none."""
LAST_DOMAIN = 232
"""With more, RTPS's port numbers would pass 65535."""


def domain() -> int:
    """The DDS domain, as PX4's start script takes it: ROS_DOMAIN_ID, else 0. Raises Trouble."""
    told = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not told.isdigit() or int(told) > LAST_DOMAIN:
        raise Trouble(f"--dds: ROS_DOMAIN_ID={told}: give 0 to {LAST_DOMAIN}")
    return int(told)


def namespace(instance: int) -> str:
    """The namespace of an instance, as PX4's start script takes it: PX4_UXRCE_DDS_NS, else that of its number."""
    return os.environ.get(NAMESPACE, dds_topics.namespace(instance))


def check(vehicles: int) -> None:
    """Raise Trouble where nobody could speak DDS for so many vehicles."""
    if importlib.util.find_spec("cyclonedds") is None:
        raise Trouble("--dds needs Cyclone DDS: pip install 'sitl-emu[ros2]'")
    domain()
    if vehicles > 1 and NAMESPACE in os.environ:
        raise Trouble(f"--dds: {NAMESPACE} is one vehicle's namespace, and there are {vehicles} vehicles")


def packet(samples: Iterable[Sample]) -> bytes:
    """Samples as they pass the socket."""
    return b"".join(HEADER.pack(topic, len(data)) + data for topic, data in samples)


def samples(data: bytes) -> Iterator[Sample]:
    """The samples of a packet."""
    at = 0
    while at < len(data):
        topic, length = HEADER.unpack_from(data, at)
        at += HEADER.size
        yield Sample(topic, data[at : at + length])
        at += length


def clock_sample(time_us: int) -> Sample:
    """The time, for /clock."""
    return Sample(CLOCK, TIME.pack(time_us))


class DdsSocket:
    """An autopilot's end."""

    def __init__(self, opened: socket.socket) -> None:
        self._socket, self._fileno = opened, opened.fileno()
        opened.setblocking(False)
        self._lost = False

    def fileno(self) -> int:
        """For who waits; the same when it is closed."""
        return self._fileno

    def send(self, samples: list[Sample]) -> None:
        """Hand samples to the agent, and empty the list."""
        if not self._lost and samples:
            try:
                self._socket.send(packet(samples))
            except BlockingIOError:
                pass
            except ConnectionError:
                self._lose()
        samples.clear()

    def receive(self) -> list[Sample]:
        """What came from ROS 2."""
        received = list[Sample]()
        for _ in range(AT_ONCE):
            try:
                data = self._socket.recv(LARGEST_PACKET_BYTES)
            except BlockingIOError:
                break
            except ConnectionError:
                data = b""
            if not data:
                self._lose()
                break
            received += samples(data)
        return received

    @property
    def lost(self) -> bool:
        """The agent has gone."""
        return self._lost

    def close(self) -> None:
        """Let the agent know that this vehicle is no more."""
        self._socket.close()

    def _lose(self) -> None:
        if not self._lost:
            self._lost = True
            print("sitl-emu: the DDS agent has ended: ROS 2 hears nothing any more", file=sys.stderr)


class Agent:
    """The agent of some autopilots, by instance."""

    def __init__(self, instances: Sequence[int]) -> None:
        """Start it. Raises Trouble and OSError."""
        ours, theirs = dict[int, DdsSocket](), dict[int, socket.socket]()
        for instance in instances:
            left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            for end in (left, right):
                end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
            ours[instance], theirs[instance] = DdsSocket(left), right
        self.sockets = ours
        arguments = [f"{instance}:{end.fileno()}" for instance, end in theirs.items()]
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "sitl_emu.run.dds_agent", str(domain()), *arguments],
            stdin=subprocess.DEVNULL,
            pass_fds=[end.fileno() for end in theirs.values()],
            start_new_session=True,
        )
        for end in theirs.values():
            end.close()

    def close(self) -> None:
        """End it: it goes when the last of its autopilots has gone."""
        for each in self.sockets.values():
            each.close()
        self._process.wait()
