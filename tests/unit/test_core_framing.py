"""Frames in bytes: found whole, whatever lies between and however they are cut; nothing is kept for ever."""

from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing

LONGEST_FRAME = 280


def frame(version: int = 2, sequence: int = 0, key: bytes | None = None) -> bytes:
    codec: Any = mavlink.MAVLink(None, srcSystem=7, srcComponent=191)
    codec.seq = sequence
    if key is not None:
        codec.signing.secret_key, codec.signing.sign_outgoing = key, True
    return bytes(codec.heartbeat_encode(2, 12, 0, 0, 3).pack(codec, force_mavlink1=version == 1))


@pytest.mark.parametrize(
    ("whole", "signed"),
    [(frame(1), False), (frame(2), False), (frame(2, key=bytes(32)), True)],
    ids=["1", "2", "signed"],
)
def test_frames_are_found_in_datagrams_whatever_lies_between(whole: bytes, signed: bool) -> None:
    found = framing.split(b"\x00\x17" + whole + whole + whole[:-1])
    assert found == [whole, whole]
    assert (framing.message_id(whole), framing.sender(whole), framing.is_signed(whole)) == (0, (7, 191), signed)


@given(st.integers(0, 2**32))
def test_frames_are_found_however_the_bytes_are_cut(seed: int) -> None:
    chance, splitter = Random(seed), framing.Splitter()
    sent = [frame(chance.choice((1, 2)), i) for i in range(20)]
    data, found = b"\x01\x02" + b"".join(sent), []
    while data:
        size = chance.randint(1, 40)
        found += splitter.feed(data[:size])
        data = data[size:]
    assert found == sent


@given(st.lists(st.binary(max_size=2000)))
def test_no_bytes_make_it_keep_more_than_a_frame(pieces: list[bytes]) -> None:
    splitter = framing.Splitter()
    for piece in pieces:
        splitter.feed(piece)
    assert len(splitter._rest) < LONGEST_FRAME
    splitter.feed(bytes(LONGEST_FRAME))
    assert splitter.feed(frame()) == [frame()]


def test_an_unknown_incompatibility_flag_makes_it_no_frame() -> None:
    strange = bytearray(frame())
    strange[2] = 0x02
    assert framing.split(bytes(strange) + frame()) == [frame()]
