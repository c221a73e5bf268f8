"""MAVLink 2 frames from payloads, the one way in which all of ours are made.

Source: https://mavlink.io/en/guide/serialization.html: header, payload without its trailing zeros, CRC-16/MCRF4XX over
both and the message's CRC_EXTRA. Unsigned; frames are taken apart where they are read.
"""

import struct

from fastcrc import crc16

_crc = crc16.mcrf4xx
_pack_crc = struct.Struct("<H").pack


def header_tail(system: int, component: int, message_id: int) -> bytes:
    """The end of a header: sender and message id. It stays the same for all frames of a message."""
    return bytes((system, component)) + message_id.to_bytes(3, "little")


def frame(payload: bytes, sequence: int, tail: bytes, crc_extra: bytes) -> bytes:
    """A frame around a full-length payload; `tail` as `header_tail` makes it, `crc_extra` one byte."""
    payload = payload.rstrip(b"\0") or b"\0"
    body = bytes((len(payload), 0, 0, sequence)) + tail + payload
    return b"\xfd" + body + _pack_crc(_crc(body + crc_extra))
