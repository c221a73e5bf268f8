"""Framing and forwarding: what a link makes of damaged, split and foreign bytes, and what passes to the others."""

from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, GIMBAL, ONBOARD, PAYLOAD, Peer, command_long, names, only

HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)


def frame(peer: Peer, message: Any) -> bytes:
    return bytes(message.pack(peer.encoder))


def acks(messages: list[Any]) -> int:
    return len(only(messages, "COMMAND_ACK"))


def test_two_messages_in_a_datagram_and_one_in_two() -> None:
    peer = Peer()
    data = frame(peer, command_long(401))
    assert acks(peer.send_bytes(data + data)) == 2
    assert acks(peer.send_bytes(data[:7])) == 0
    assert acks(peer.send_bytes(data[7:])) == 1


def test_mavlink_1_is_understood_and_answered_in_2() -> None:
    peer = Peer()
    message = command_long(401)
    data = bytes(message.pack(mavlink.MAVLink(None, srcSystem=255, srcComponent=190), force_mavlink1=True))
    assert data[0] == 0xFE
    peer.mavlink.on_datagram(0, GCS, data)
    assert peer.mavlink.links[GCS].outbox[0][0] == 0xFD


@pytest.mark.parametrize(
    "garbage",
    [b"", bytes(range(256)), b"\xfd" * 300, b"\xfd\x09\x00\x00\x00\xff\xbe\xff\xff\x00" + b"x" * 11],
    ids=["empty", "counting", "starts", "unknown id"],
)
def test_garbage_does_no_harm(garbage: bytes) -> None:
    peer = Peer()
    assert peer.send_bytes(garbage) == []
    for _ in range(20):  # a start byte in the garbage may swallow a frame's length of what follows
        replies = peer.send(command_long(401))
    assert acks(replies) == 1


def test_a_damaged_frame_is_dropped() -> None:
    peer = Peer()
    data = bytearray(frame(peer, command_long(401)))
    data[15] ^= 1
    assert acks(peer.send_bytes(bytes(data))) == 0
    assert acks(peer.send(command_long(401))) == 1


def test_lost_messages_are_counted() -> None:
    peer = Peer()
    peer.send(HEARTBEAT)
    peer.encoder.seq += 3
    peer.send(HEARTBEAT)
    assert peer.mavlink.links[GCS].messages_lost == 3


@pytest.mark.parametrize(
    ("target", "passes"),
    [
        ((0, 0), True),
        ((245, 191), True),
        ((255, 190), False),
        ((1, 0), False),
        ((1, 1), False),
        ((1, 100), False),
        ((77, 1), False),
    ],
)
def test_commands_pass_to_where_their_target_was_heard(target: tuple[int, int], passes: bool) -> None:
    peer, companion = Peer(), mavlink.MAVLink(None, srcSystem=245, srcComponent=191)
    peer.send(HEARTBEAT, GCS)
    peer.send_bytes(bytes(HEARTBEAT.pack(companion)), ONBOARD)
    for link in (GCS, ONBOARD):
        peer.received(link)
    peer.send(command_long(31000, target=target), GCS)
    assert ("COMMAND_LONG" in names(peer.received(ONBOARD))) == passes


def test_broadcasts_pass_unchanged_to_all_other_links() -> None:
    peer = Peer()
    data = frame(peer, HEARTBEAT)
    assert "HEARTBEAT" not in names(peer.send_bytes(data, GCS))
    for link in (ONBOARD, PAYLOAD, GIMBAL):
        assert b"".join(peer.mavlink.links[link].outbox) == data


def test_texts_of_others_do_not_pass() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_statustext_message(6, b"hello", 0, 0), ONBOARD)
    assert peer.received(GCS) == []


def test_a_datagram_is_never_longer_than_an_ethernet_frame() -> None:
    peer = Peer()
    peer.send(command_long(512, 435, 0))
    for _ in range(200):
        peer.mavlink.on_datagram(0, GCS, frame(peer, command_long(512, 435, 0)))
    assert max(len(data) for data in peer.mavlink.links[GCS].outbox) <= 1400
