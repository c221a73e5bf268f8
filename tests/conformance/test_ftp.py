"""MAVLink FTP: the metadata files of a vehicle can be listed and read; what is wrong is refused."""

import itertools
import struct
import zlib
from typing import Any, NamedTuple

import pytest

ACK, NAK = 128, 129
TERMINATE, RESET, LIST, OPEN_RO, READ, CRC32, BURST = 1, 2, 3, 4, 5, 14, 15
INVALID_DATA_SIZE, INVALID_SESSION, NO_SESSIONS, EOF, UNKNOWN_COMMAND, FILE_PROTECTED, NOT_FOUND = 3, 4, 5, 6, 7, 9, 10
GENERAL = b"etc/extras/component_general.json.xz"
XZ_MAGIC = bytes.fromhex("fd377a585a00")
LARGEST = 239
SEQUENCES = itertools.count(1, 2)
PAGE = "https://mavlink.io/en/services/ftp.html"

pytestmark = pytest.mark.covers("FILE_TRANSFER_PROTOCOL", source=PAGE)


class Reply(NamedTuple):
    sequence: int
    session: int
    opcode: int
    size: int
    req_opcode: int
    burst_complete: int
    padding: int
    offset: int
    data: bytes


def receive(station: Any) -> Reply:
    message = station.receive("FILE_TRANSFER_PROTOCOL")
    assert message is not None
    raw = bytes(message.payload)
    head = struct.unpack("<HBBBBBBI", raw[:12])
    return Reply(*head, raw[12 : 12 + head[3]])


def ask(
    station: Any, opcode: int, data: bytes = b"", offset: int = 0, size: int | None = None, session: int = 0
) -> Reply:
    sequence = next(SEQUENCES)
    length = len(data) if size is None else size
    head = struct.pack("<HBBBBBBI", sequence, session, opcode, length, 0, 0, 0, offset)
    station.mav.file_transfer_protocol_send(0, station.system, 1, (head + data).ljust(251, b"\0"))
    reply = receive(station)
    assert (reply.sequence, reply.req_opcode) == (sequence + 1, opcode)
    return reply


@pytest.fixture(autouse=True)
def no_session(station: Any) -> None:
    assert ask(station, RESET).opcode == ACK


def test_list(station: Any) -> None:
    entries = [entry.split(b"\t")[0] for entry in ask(station, LIST, b"etc/extras").data.split(b"\0")]
    assert {b"Fcomponent_general.json.xz", b"Fparameters.json.xz"} <= set(entries)


def test_a_file_comes_whole_in_reads_and_in_a_burst(station: Any) -> None:
    opened = ask(station, OPEN_RO, GENERAL)
    size = struct.unpack("<I", opened.data)[0]
    content = b""
    while len(content) < size:
        content += ask(station, READ, offset=len(content), size=LARGEST).data
    assert content[:6] == XZ_MAGIC
    assert ask(station, READ, offset=size, size=1).data == bytes((EOF,))
    reply, burst = ask(station, BURST, size=LARGEST), b""
    while reply.opcode == ACK:
        burst += reply.data
        reply = receive(station)
    while next(SEQUENCES) <= reply.sequence:
        pass  # every message of a burst has a number: an older one would ask for the last answer again
    assert (burst, reply.data) == (content, bytes((EOF,)))
    crc = struct.unpack("<I", ask(station, CRC32, GENERAL).data)[0]
    assert crc == zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF
    assert ask(station, TERMINATE).opcode == ACK


@pytest.mark.covers(source="measured: which error each mistake gets")
@pytest.mark.parametrize(
    ("opcode", "data", "size", "error"),
    [
        (OPEN_RO, b"no_such_file", None, NOT_FOUND),
        (LIST, b"no_such_dir", None, NOT_FOUND),
        (LIST, b"../..", None, FILE_PROTECTED),
        (READ, b"", 10, INVALID_SESSION),
        (127, b"", None, UNKNOWN_COMMAND),
        (LIST, b"etc", 240, INVALID_DATA_SIZE),
    ],
)
def test_refusals(station: Any, opcode: int, data: bytes, size: int | None, error: int) -> None:
    reply = ask(station, opcode, data, size=size, session=9 if opcode == READ else 0)
    assert (reply.opcode, reply.data) == (NAK, bytes((error,)))


@pytest.mark.covers(source="measured: one session, no second")
def test_one_file_at_a_time(station: Any) -> None:
    assert ask(station, OPEN_RO, GENERAL).opcode == ACK
    second = ask(station, OPEN_RO, GENERAL)
    assert (second.opcode, second.data) == (NAK, bytes((NO_SESSIONS,)))
