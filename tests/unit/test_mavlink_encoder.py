"""Frames of our encoder are pymavlink's, byte for byte, for every message that a stream or a service sends."""

import struct
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.autopilot.mavlink.encoder import AUTOPILOT_COMPONENT, EXTENSIONS, Encoder
from sitl_emu.autopilot.mavlink.streams import modules
from sitl_emu.core import dialect as mavlink

SERVICE_MESSAGES = (22, 39, 40, 44, 46, 47, 51, 73, 77, 110, 111, 126, 244, 253, 410, 411, 413)
SENT = sorted({module.ID for module in modules().values()} | set(SERVICE_MESSAGES))


def fields_from(table: Any, raw: bytes) -> list[Any]:
    """The fields that a payload means, in wire order: lists for arrays, bytes for strings."""
    flat = list(table.unpacker.unpack(raw))
    if len(flat) == len(table.array_lengths):
        return flat
    fields: list[Any] = []
    for length in table.array_lengths:
        if length > 1 and not isinstance(flat[0], bytes):
            fields.append([flat.pop(0) for _ in range(length)])
        else:
            fields.append(flat.pop(0))
    return fields


@pytest.mark.parametrize("message_id", SENT, ids=lambda number: mavlink.mavlink_map[number].msgname)
@settings(max_examples=10)
@given(raw=st.binary(min_size=280, max_size=280), used=st.integers(0, 280), sequence=st.integers(0, 255))
def test_frame_is_pymavlinks(message_id: int, raw: bytes, used: int, sequence: int) -> None:
    table = mavlink.mavlink_map[message_id]
    size = table.unpacker.size
    fields = fields_from(table, raw[: min(used, size)].ljust(size, b"\0"))
    peer = mavlink.MAVLink(None, srcSystem=7, srcComponent=AUTOPILOT_COMPONENT)
    peer.seq = sequence
    message = table(**dict(zip(table.ordered_fieldnames, fields, strict=True)))
    expected = bytes(message.pack(peer))
    codec = Encoder(7).codec(message_id)
    flat = [value for field in fields for value in (field if isinstance(field, list) else [field])]
    extension = [0] * len(EXTENSIONS.get(message_id, ""))
    assert codec.frame(codec.pack(*flat, *extension), sequence) == expected


def test_extension_fields_follow_the_dialects() -> None:
    codec = Encoder(1).codec(mavlink.MAVLINK_MSG_ID_MISSION_COUNT)
    frame = codec.frame(codec.pack(3, 255, 190, 0, 0x12345678), 0)
    assert frame[10:-2] == struct.pack("<HBBBI", 3, 255, 190, 0, 0x12345678)


def test_an_empty_payload_keeps_one_byte() -> None:
    codec = Encoder(1).codec(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
    assert codec.frame(codec.pack(0, 0), 0)[1] == 1


def test_a_number_too_large_for_its_field_wraps_as_in_c() -> None:
    codec = Encoder(1).codec(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
    payload = codec.pack(1, 2, 3, 4, 5, 40_000, -40_000, 0, 36_000)
    assert struct.unpack("<Iiiiihhhh"[:-1] + "H", payload)[5:7] == (40_000 - 65_536, 65_536 - 40_000)
