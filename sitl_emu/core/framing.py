"""MAVLink frames: made from payloads, and found in bytes. The one place that knows the layout of a frame.

Source: https://mavlink.io/en/guide/serialization.html: header, payload without its trailing zeros, CRC-16/MCRF4XX over
both and the message's CRC_EXTRA, a signature if the header says so. Nothing is decoded here, no signature is checked.
"""

import re
import struct
from typing import Final, NamedTuple

from fastcrc import crc16

STX_V1: Final = 0xFE
STX_V2: Final = 0xFD
SIGNED: Final = 0x01
"""The incompatibility flag of a signed frame, the only one there is."""
SIGNATURE_BYTES: Final = 13
HEADER_V1_BYTES: Final = 6
HEADER_V2_BYTES: Final = 10
CRC_BYTES: Final = 2

_crc: Final = crc16.mcrf4xx
_crc_layout: Final = struct.Struct("<H")
_pack_crc: Final = _crc_layout.pack
_header_v1: Final = struct.Struct("<xBBBBB")
_header_v2: Final = struct.Struct("<xBxxBBBHB")
_start: Final = re.compile(rb"[\xfd\xfe]")


def header_tail(system: int, component: int, message_id: int) -> bytes:
    """The end of a header: sender and message id. It stays the same for all frames of a message."""
    return bytes((system, component)) + message_id.to_bytes(3, "little")


def frame(payload: bytes, sequence: int, tail: bytes, crc_extra: bytes, flags: int = 0) -> bytes:
    """A MAVLink 2 frame around a full-length payload; `tail` as `header_tail` makes it, `crc_extra` one byte.

    With `flags` SIGNED the signature is still to be appended.
    """
    payload = payload.rstrip(b"\0") or b"\0"
    body = bytes((len(payload), flags, 0, sequence)) + tail + payload
    return b"\xfd" + body + _pack_crc(_crc(body + crc_extra))


class Header(NamedTuple):
    """What a whole frame says of itself."""

    sequence: int
    system: int
    component: int
    message_id: int
    payload_start: int
    payload_end: int


def header(frame: bytes) -> Header:
    """The header of a whole frame."""
    if frame[0] == STX_V1:
        size, sequence, system, component, number = _header_v1.unpack_from(frame)
        return Header(sequence, system, component, number, HEADER_V1_BYTES, HEADER_V1_BYTES + size)
    size, sequence, system, component, low, high = _header_v2.unpack_from(frame)
    return Header(sequence, system, component, low | high << 16, HEADER_V2_BYTES, HEADER_V2_BYTES + size)


def is_intact(frame: bytes, end: int, crc_extra: bytes) -> bool:
    """Whether the CRC of a whole frame is right, of which the payload ends at `end`."""
    right: bool = _crc(frame[1:end] + crc_extra) == _crc_layout.unpack_from(frame, end)[0]
    return right


def message_id(frame: bytes) -> int:
    """The message id of a whole frame."""
    if frame[0] == STX_V1:
        return frame[5]
    return frame[7] | frame[8] << 8 | frame[9] << 16


def sender(frame: bytes) -> tuple[int, int]:
    """System and component that a whole frame says it comes from."""
    return (frame[3], frame[4]) if frame[0] == STX_V1 else (frame[5], frame[6])


def is_signed(frame: bytes) -> bool:
    """Whether a whole frame bears a signature, right or wrong."""
    return frame[0] == STX_V2 and bool(frame[2] & SIGNED)


class Splitter:
    """Cuts bytes as they come into frames of MAVLink 1 and 2; what is no frame is left out, what is none yet is kept.

    As the MAVLink C library's parser does, it believes a start byte and the length after it: a damaged length costs
    what follows, up to a frame's length. A frame with an unknown incompatibility flag is none.
    """

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """The frames that these bytes complete, CRC unchecked."""
        if self._rest:
            data = self._rest + data
        frames = []
        at, end = 0, len(data)
        while found := _start.search(data, at):
            at = found.start()
            if at + 3 > end:
                break
            if data[at] == STX_V1:
                size = HEADER_V1_BYTES + CRC_BYTES + data[at + 1]
            elif data[at + 2] & ~SIGNED:
                at += 3
                continue
            else:
                signature = SIGNATURE_BYTES if data[at + 2] & SIGNED else 0
                size = HEADER_V2_BYTES + CRC_BYTES + data[at + 1] + signature
            if at + size > end:
                break
            frames.append(data[at : at + size])
            at += size
        else:
            at = end
        self._rest = data[at:]
        return frames


def split(datagram: bytes) -> list[bytes]:
    """The whole frames in a datagram, CRC unchecked."""
    return Splitter().feed(datagram)
