"""The sockets of the links: who is answered, what a flood may cost, what becomes of long datagrams and lost peers."""

import socket
from collections.abc import Iterator

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.core.ports import LinkPorts
from sitl_emu.missions.companion.links import Link, UdpPort
from sitl_emu.run.link_sockets import AT_ONCE, LARGEST_DATAGRAM_BYTES, LinkSockets, Poll, PortInUseError

LIMIT_S = 2.0


class Wire:
    """A link of which only the outbox matters."""

    def __init__(self, local: int, remote: int, name: str = "gcs") -> None:
        self.name, self.ports = name, LinkPorts(local, remote)
        self.outbox: list[bytes] = []


def peer() -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind(("127.0.0.1", 0))
    opened.settimeout(LIMIT_S)
    return opened


def free_port() -> int:
    with peer() as opened:
        return int(opened.getsockname()[1])


class Bench:
    """One link on a free port, and a ground station at its standing remote port."""

    def __init__(self) -> None:
        self.standing = peer()
        self.wire = Wire(free_port(), int(self.standing.getsockname()[1]))
        self.sockets = LinkSockets([self.wire])
        self.poll: Poll[str] = Poll()
        for fileno in self.sockets.filenos().values():
            self.poll.watch(fileno, self.wire.name)
        self.address = ("127.0.0.1", self.wire.ports.local)

    def heard(self) -> list[bytes]:
        assert self.poll.wait(LIMIT_S) == [self.wire.name]
        return self.sockets.receive(0)

    def say(self, data: bytes) -> None:
        self.wire.outbox.append(data)
        self.sockets.flush()
        assert self.wire.outbox == []

    def close(self) -> None:
        self.sockets.close()
        self.standing.close()


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_the_first_who_speaks_is_spoken_to_from_then_on_and_all_are_heard(bench: Bench) -> None:
    with peer() as first, peer() as second:
        bench.say(b"to the standing port")
        assert bench.standing.recv(100) == b"to the standing port"
        for speaker in (first, second):
            speaker.sendto(b"here", bench.address)
            assert bench.heard() == [b"here"]
            bench.say(b"answer")
            assert first.recv(100) == b"answer"


def test_a_peer_that_left_does_no_harm_and_may_come_back(bench: Bench) -> None:
    gone = peer()
    address = gone.getsockname()
    gone.sendto(b"here", bench.address)
    assert bench.heard() == [b"here"]
    gone.close()
    for _ in range(3):
        bench.say(b"nobody hears this")
    assert bench.sockets.receive(0) == []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as back:
        back.bind(address)
        back.settimeout(LIMIT_S)
        bench.say(b"again")
        assert back.recv(100) == b"again"


def test_a_flood_is_served_in_portions(bench: Bench) -> None:
    with peer() as flood:
        for number in range(3 * AT_ONCE):
            flood.sendto(b"%d" % number, bench.address)
        heard = [bench.heard() for _ in range(3)]
    assert [len(portion) for portion in heard] == [AT_ONCE] * 3
    assert [data for portion in heard for data in portion] == [b"%d" % number for number in range(3 * AT_ONCE)]


def test_of_a_long_datagram_the_start_is_read(bench: Bench) -> None:
    with peer() as long:
        long.sendto(bytes(65_507), bench.address)
        assert [len(data) for data in bench.heard()] == [LARGEST_DATAGRAM_BYTES]
        long.sendto(b"", bench.address)
        assert bench.heard() == [b""]


def test_in_lockstep_strangers_are_not_counted(bench: Bench) -> None:
    with peer() as stranger:
        stranger.sendto(b"not announced", bench.address)
        for data in (b"one", b"two"):
            bench.standing.sendto(data, bench.address)
        assert bench.sockets.receive(0, exactly=2) == [b"one", b"two"]
        bench.say(b"answer")
        assert bench.standing.recv(100) == b"answer"


def test_a_companion_in_lockstep_hears_its_own_autopilot_alone() -> None:
    with peer() as stranger, peer() as autopilot:
        port = UdpPort(("127.0.0.1", 0), autopilot.getsockname(), remote_alone=True, wait_s=LIMIT_S)
        link = Link(port)
        try:
            for speaker, system in ((stranger, 31), (autopilot, 10)):
                heartbeat = mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)
                speaker.sendto(heartbeat.pack(mavlink.MAVLink(None, system, 1)), ("127.0.0.1", port.address[1]))
            assert [message.get_srcSystem() for message in link.receive_exactly(0, 1)] == [10]
        finally:
            link.close()


def test_one_wait_tells_of_all_that_is_watched_until_it_is_forgotten(bench: Bench) -> None:
    one, other = socket.socketpair()
    with one, other, peer() as speaker:
        bench.poll.watch(one.fileno(), "tick")
        other.send(b"tick")
        assert bench.poll.wait(LIMIT_S) == ["tick"]
        speaker.sendto(b"here", bench.address)
        while "gcs" not in (ready := bench.poll.wait(LIMIT_S)):
            pass
        assert set(ready) == {"tick", "gcs"}
        bench.poll.forget(one.fileno())
        bench.poll.forget(other.fileno())
        assert bench.poll.wait(LIMIT_S) == ["gcs"]


def test_a_link_that_begins_anew_keeps_its_port_and_forgets_its_peer(bench: Bench) -> None:
    with peer() as first:
        first.sendto(b"here", bench.address)
        assert bench.heard() == [b"here"]
        bench.wire = Wire(*bench.wire.ports)
        bench.sockets.restart([bench.wire])
        bench.say(b"to the standing port")
        assert bench.standing.recv(100) == b"to the standing port"
        first.sendto(b"here again", bench.address)
        assert bench.heard() == [b"here again"]
        bench.say(b"answer")
        assert first.recv(100) == b"answer"
    assert bench.sockets.take_sent(0) == 2
    assert bench.sockets.take_sent(0) == 0


def test_a_port_in_use_is_named_with_its_remedy(bench: Bench) -> None:
    with pytest.raises(PortInUseError, match=rf"UDP port {bench.wire.ports.local} .* choose another --instance"):
        LinkSockets([Wire(bench.wire.ports.local, 1)])
