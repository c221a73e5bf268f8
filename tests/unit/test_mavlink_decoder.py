"""What is read of a frame is what pymavlink reads of it."""

import random
from typing import Any

import pytest

from sitl_emu.autopilot.mavlink.decoder import decode
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing

TABLE: dict[int, Any] = dict(mavlink.mavlink_map)


def a_frame(message_id: int, payload: bytes) -> bytes:
    tail = framing.header_tail(255, 190, message_id)
    return framing.frame(payload, 7, tail, bytes((TABLE[message_id].crc_extra,)))


def plain(value: Any) -> Any:
    """Arrays of bytes are lists of numbers in pymavlink; NaN equals itself as text."""
    return repr(list(value) if isinstance(value, bytes) else value)


def assert_alike(frame: bytes) -> None:
    ours, theirs = decode(frame), mavlink.MAVLink(None).decode(bytearray(frame))
    assert ours is not None
    assert ours.get_msgbuf() == bytes(theirs.get_msgbuf())
    for name in ("get_msgId", "get_srcSystem", "get_srcComponent", "get_seq"):
        assert getattr(ours, name)() == getattr(theirs, name)(), name
    for name in theirs.ordered_fieldnames:
        assert plain(getattr(ours, name)) == plain(getattr(theirs, name)), (theirs.get_type(), name)


@pytest.mark.parametrize("message_id", TABLE)
def test_every_message_with_any_bytes(message_id: int) -> None:
    chance, size = random.Random(message_id), TABLE[message_id].unpacker.size
    for length in (size, size, size // 2, 1):
        assert_alike(a_frame(message_id, chance.randbytes(length)))
    assert_alike(a_frame(message_id, bytes(size)))


def test_mavlink_1_and_fields_of_a_later_dialect() -> None:
    sender = mavlink.MAVLink(None, srcSystem=3, srcComponent=4)
    assert_alike(bytes(mavlink.MAVLink_param_set_message(1, 1, b"MPC_XY_P", 0.5, 9).pack(sender, force_mavlink1=True)))
    assert_alike(a_frame(mavlink.MAVLINK_MSG_ID_HEARTBEAT, bytes(range(1, 30))))


def test_texts_end_at_their_first_zero() -> None:
    frame = a_frame(mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ, b"\0\0\1\1MPC\0\xffXY".ljust(20, b"\0"))
    message = decode(frame)
    assert message is not None
    assert message.param_id == "MPC"


def test_a_wrong_crc_and_an_unknown_message_are_none() -> None:
    frame = a_frame(mavlink.MAVLINK_MSG_ID_HEARTBEAT, bytes(range(9)))
    assert decode(frame) is not None
    assert all(decode(frame[:n] + bytes((frame[n] ^ 1,)) + frame[n + 1 :]) is None for n in range(4, len(frame)))
    assert decode(framing.frame(b"abc", 0, framing.header_tail(1, 1, 0xFFFFFE), b"\0")) is None
