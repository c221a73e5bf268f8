"""Framing: what is understood, however it comes, and what is dropped without an answer.

Frames that are damaged, cut or unknown are not answered, and what follows them is; MAVLink 1 is understood and answered
in MAVLink 2 (measured misc/framing/*).
"""

from typing import Any

import pytest

pytestmark = [
    pytest.mark.covers("COMMAND_LONG", source="https://mavlink.io/en/guide/serialization.html"),
    pytest.mark.covers(
        "COMMAND_LONG", source="measured misc/framing/*: one acknowledgement for each whole frame, none for another"
    ),
]

RUN_PREARM_CHECKS = 401
SILENCE_S = 0.7
SWALLOWED = 10
"""Frames sent after a cut one, whose missing bytes the first of them may become."""
STX_V2 = 0xFD


def frame(station: Any, **options: bool) -> bytes:
    """A COMMAND_LONG RUN_PREARM_CHECKS, numbered as the next of ours."""
    message = station.mav.command_long_encode(station.system, 1, RUN_PREARM_CHECKS, 0, 0, 0, 0, 0, 0, 0, 0)
    packed = bytes(message.pack(station.mav, **options))
    station.mav.seq = (station.mav.seq + 1) % 256
    return packed


def acks(station: Any, *datagrams: bytes, at_least: int = 0) -> list[Any]:
    """The acknowledgements of these datagrams."""
    station.heartbeat()
    for data in datagrams:
        station.link.write(data)
    return [ack for ack in station.collect("COMMAND_ACK", SILENCE_S, at_least) if ack.command == RUN_PREARM_CHECKS]


def test_mavlink_1_is_answered_in_mavlink_2(station: Any) -> None:
    (ack,) = acks(station, frame(station, force_mavlink1=True), at_least=1)
    assert ack.get_msgbuf()[0] == STX_V2


def test_two_messages_in_a_datagram_are_two_messages(station: Any) -> None:
    assert len(acks(station, frame(station) + frame(station), at_least=2)) == 2


def test_a_message_in_two_datagrams_is_one_message(station: Any) -> None:
    whole = frame(station)
    assert len(acks(station, whole[:7], whole[7:], at_least=1)) == 1


@pytest.mark.parametrize("place", [4, 8, 12, -1], ids=["sequence", "message id", "payload", "crc"])
def test_a_changed_byte_costs_the_message(station: Any, place: int) -> None:
    spoiled = bytearray(frame(station))
    spoiled[place] ^= 0x40
    assert acks(station, bytes(spoiled)) == []
    assert len(acks(station, frame(station), at_least=1)) == 1


def test_what_follows_a_cut_message_is_understood_again(station: Any) -> None:
    assert acks(station, frame(station)[:20]) == []
    assert acks(station, *(frame(station) for _ in range(SWALLOWED)), at_least=1)
    assert len(acks(station, frame(station), at_least=1)) == 1


@pytest.mark.parametrize(
    "data",
    [b"", bytes(300), bytes(range(0xFD)), b"\xfd\x00\x00\x00\x00\xff\xbe\xff\xff\xff\x00\x00"],
    ids=["empty", "zeros", "counting", "unknown message"],
)
def test_what_is_no_message_is_not_answered(station: Any, data: bytes) -> None:
    assert acks(station, data) == []
    assert len(acks(station, frame(station), at_least=1)) == 1
