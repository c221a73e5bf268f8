"""Hostile datagrams over the real sockets: the largest there are, many messages in one, a peer that has left."""

import random
import socket
import time
from collections.abc import Iterator
from typing import Any

import pytest
from pymavlink import mavutil

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing
from tests import hostile
from tests.launched import launched

INSTANCE = 14
GCS_PORT, ONBOARD_PORT = 18570 + INSTANCE, 14580 + INSTANCE
LARGEST = 65_507
READ_AT_MOST = 8_000
"""Bytes of a datagram; PX4 drops the rest."""
START_LIMIT_S = 60.0
LIMIT_S = 5.0


class Peer:
    """A socket that speaks to one of the vehicle's ports."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.settimeout(LIMIT_S)
        self.codec: Any = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        self._ear: Any = mavlink.MAVLink(None)

    def send(self, data: bytes) -> None:
        self._socket.send(data)

    def pack(self, message: Any) -> bytes:
        frame = bytes(message.pack(self.codec))
        self.codec.seq = (self.codec.seq + 1) & 255
        return frame

    def wait(self, name: str, count: int = 1) -> int:
        """How many of a name came, until there are `count`, or no more comes in LIMIT_S."""
        found, until = 0, time.monotonic() + LIMIT_S
        while found < count and time.monotonic() < until:
            try:
                data = self._socket.recv(LARGEST)
            except TimeoutError:
                break
            messages = self._ear.parse_buffer(data) or []
            more = sum(message.get_type() == name for message in messages)
            if more:
                found, until = found + more, time.monotonic() + LIMIT_S
        return found

    def close(self) -> None:
        self._socket.close()


@pytest.fixture(scope="module")
def vehicle() -> Iterator[None]:
    with launched("sihsim_hex", "--instance", str(INSTANCE)):
        link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{13280 + INSTANCE}")
        heard = link.wait_heartbeat(timeout=START_LIMIT_S)
        link.close()
        assert heard is not None
        yield


@pytest.fixture
def station(vehicle: None) -> Iterator[Peer]:
    peer = Peer(GCS_PORT)
    yield peer
    peer.close()


def ping(number: int) -> Any:
    return mavlink.MAVLink_ping_message(1, number, 0, 0)


def test_a_vehicle_bears_hostile_datagrams_and_answers_afterwards(station: Peer) -> None:
    station.send(station.pack(ping(0)))
    assert station.wait("PING") == 1
    chance = random.Random(3)
    nonsense = hostile.Nonsense(chance, [0, 11, 23, 44, 73, 75, 76, 84, 110, 126], ["MPC_XY_CRUISE"])
    seeds = [station.pack(ping(number)) for number in range(20)]
    for _ in range(40):
        for _ in range(50):
            frame = nonsense.frame()
            number = framing.message_id(frame)
            # A key or the end of the process would be obeyed, and this test is about what is not.
            if number not in (mavlink.MAVLINK_MSG_ID_SETUP_SIGNING, 75, 76):
                station.send(frame)
            station.send(hostile.mutated(chance, seeds))
        station.send(station.pack(ping(1)))
        station.wait("PING")
    for data in (bytes(LARGEST), b"\xfd" * LARGEST, chance.randbytes(LARGEST), b""):
        station.send(data)
    station.send(bytes(300))
    for _ in range(3):
        station.send(station.pack(ping(2)))
    assert station.wait("PING", 3) >= 3


def test_a_datagram_full_of_messages_is_answered_message_by_message(station: Peer) -> None:
    onboard = Peer(ONBOARD_PORT)
    try:
        # with so much between them that the answers fit a socket's buffer, whenever they are read
        frame = onboard.pack(ping(9)) + onboard.pack(mavlink.MAVLink_debug_float_array_message(1, b"", 0, [1.0] * 58))
        count = READ_AT_MOST // len(frame)
        assert 20 < count < 100
        onboard.send(frame * count)
        assert onboard.wait("PING", count) == count
    finally:
        onboard.close()
