"""MAVLink FTP: files are listed, read, written and removed; what is wrong is refused."""

import itertools
import struct
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest

ACK, NAK = 128, 129
NONE, TERMINATE, RESET, LIST, OPEN_RO, READ, CREATE, WRITE, REMOVE, MKDIR, RMDIR = range(11)
OPEN_WO, TRUNCATE, RENAME, CRC32, BURST, LIST_WITH_TIME = range(11, 17)
FAIL_ERRNO, FILE_EXISTS = 2, 8
EBADF, EISDIR, ENOTEMPTY = 9, 21, 39
INVALID_DATA_SIZE, INVALID_SESSION, NO_SESSIONS, EOF, UNKNOWN_COMMAND, FILE_PROTECTED, NOT_FOUND = 3, 4, 5, 6, 7, 9, 10
GENERAL = b"etc/extras/component_general.json.xz"
FOLDER, FILE, OTHER = b"conformance", b"conformance/file.txt", b"conformance/other.txt"
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
    return Reply._make((*head, raw[12 : 12 + head[3]]))


def ask(
    station: Any,
    opcode: int,
    data: bytes = b"",
    offset: int = 0,
    size: int | None = None,
    session: int = 0,
    sequence: int | None = None,
) -> Reply:
    sequence = next(SEQUENCES) if sequence is None else sequence
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


@pytest.mark.covers(source="measured ftp/error/*, ftp/list/*: which error each mistake gets")
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


@pytest.mark.covers(source="measured ftp/session/three_opens: one session, no second")
def test_one_file_at_a_time(station: Any) -> None:
    assert ask(station, OPEN_RO, GENERAL).opcode == ACK
    second = ask(station, OPEN_RO, GENERAL)
    assert (second.opcode, second.data) == (NAK, bytes((NO_SESSIONS,)))


def said(reply: Reply) -> tuple[int, ...]:
    """(ACK,) or NAK with its numbers."""
    return (ACK,) if reply.opcode == ACK else (NAK, *reply.data)


@pytest.fixture
def folder(station: Any) -> Iterator[bytes]:
    """A folder to work in, gone afterwards."""

    def clear() -> None:
        for opcode, path in ((RESET, b""), (REMOVE, FILE), (REMOVE, OTHER), (RMDIR, FOLDER)):
            ask(station, opcode, path)

    clear()
    assert ask(station, MKDIR, FOLDER).opcode == ACK
    yield FOLDER
    clear()


def test_a_file_is_written_and_read_back(station: Any, folder: bytes) -> None:
    assert ask(station, CREATE, FILE).data == bytes(4)
    assert ask(station, WRITE, b"0123456789").data == struct.pack("<I", 10)
    assert ask(station, WRITE, b"xyz", offset=20).data == struct.pack("<I", 3)
    assert ask(station, TERMINATE).opcode == ACK
    content = b"0123456789" + bytes(10) + b"xyz"
    assert ask(station, OPEN_RO, b"/" + FILE).data == struct.pack("<I", len(content))
    assert ask(station, READ, offset=5, size=10).data == content[5:15]
    assert ask(station, READ, size=LARGEST).data == content
    assert ask(station, TERMINATE).opcode == ACK
    crc = struct.unpack("<I", ask(station, CRC32, FILE).data)[0]
    assert crc == zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


def test_a_file_is_cut_renamed_and_removed(station: Any, folder: bytes) -> None:
    ask(station, CREATE, FILE)
    ask(station, WRITE, b"0123456789")
    ask(station, TERMINATE)
    assert ask(station, TRUNCATE, FILE, offset=5).opcode == ACK
    assert ask(station, LIST, folder).data.replace(b"S\0", b"") == b"Ffile.txt\t5\0"
    assert ask(station, RENAME, FILE + b"\0" + OTHER + b"\0").opcode == ACK
    assert ask(station, LIST, folder).data.replace(b"S\0", b"") == b"Fother.txt\t5\0"
    assert ask(station, REMOVE, OTHER).opcode == ACK
    assert ask(station, LIST, folder).data == b"S\0S\0"
    assert ask(station, RMDIR, folder).opcode == ACK
    assert said(ask(station, LIST, folder)) == (NAK, NOT_FOUND)


@pytest.mark.covers(
    source="measured ftp/write/*: which error each mistake gets, and that errno is told as it is on Linux"
)
def test_refusals_of_writing(station: Any, folder: bytes) -> None:
    assert said(ask(station, MKDIR, folder)) == (NAK, FILE_EXISTS)
    ask(station, CREATE, FILE)
    ask(station, WRITE, b"0123456789")
    ask(station, TERMINATE)
    assert ask(station, OPEN_WO, FILE).data == struct.pack("<I", 10)
    assert said(ask(station, READ, size=5)) == (NAK, FAIL_ERRNO, EBADF)
    assert said(ask(station, OPEN_WO, OTHER)) == (NAK, NO_SESSIONS)
    ask(station, TERMINATE)
    assert said(ask(station, RMDIR, folder)) == (NAK, FAIL_ERRNO, ENOTEMPTY)
    assert said(ask(station, RENAME, OTHER + b"\0" + FILE + b"\0")) == (NAK, NOT_FOUND)
    assert said(ask(station, REMOVE, OTHER)) == (NAK, NOT_FOUND)
    assert said(ask(station, REMOVE, folder)) == (NAK, FAIL_ERRNO, EISDIR)
    assert said(ask(station, RMDIR, b"no_such_folder")) == (NAK, NOT_FOUND)
    assert said(ask(station, CREATE, b"no_such_folder/file")) == (NAK, NOT_FOUND)
    assert said(ask(station, OPEN_RO, FILE)) == (ACK,)
    assert said(ask(station, WRITE, b"x")) == (NAK, FAIL_ERRNO, EBADF)


@pytest.mark.covers(source="measured ftp/write/26_open_directory: a folder can be opened, and gives EISDIR")
def test_a_folder_is_not_read(station: Any) -> None:
    assert ask(station, OPEN_RO, b"etc").opcode == ACK
    assert said(ask(station, READ, size=10)) == (NAK, FAIL_ERRNO, EISDIR)


def test_a_request_that_comes_again_is_not_done_twice(station: Any, folder: bytes) -> None:
    ask(station, RMDIR, folder)
    sequence = next(SEQUENCES)
    assert [ask(station, MKDIR, folder, sequence=sequence).opcode for _ in range(2)] == [ACK, ACK]
    assert said(ask(station, MKDIR, folder)) == (NAK, FILE_EXISTS)


@pytest.mark.covers(source="measured ftp/error/opcode_16: opcode 16 is answered, as that page wants it")
def test_a_list_with_time_gives_size_and_seconds_since_1970(station: Any, folder: bytes) -> None:
    ask(station, CREATE, FILE)
    ask(station, WRITE, b"0123456789")
    ask(station, TERMINATE)
    entry = ask(station, LIST_WITH_TIME, folder).data.replace(b"S\0", b"").rstrip(b"\0")
    name, size, modified_s = entry.split(b"\t")
    assert (name, size) == (b"Ffile.txt", b"10")
    assert int(modified_s) > 1_500_000_000


@pytest.mark.covers(source="measured ftp/burst/*: packets of a burst are full whatever was asked for, and 168 make one")
def test_a_long_file_comes_in_several_bursts(station: Any, folder: bytes) -> None:
    content = bytes(range(251)) * 200
    ask(station, CREATE, FILE)
    for offset in range(0, len(content), LARGEST):
        assert ask(station, WRITE, content[offset : offset + LARGEST], offset=offset).opcode == ACK
    ask(station, TERMINATE)
    ask(station, OPEN_RO, FILE)
    got, lengths = b"", []
    while len(got) < len(content):
        reply, count = ask(station, BURST, offset=len(got), size=80), 0
        while reply.opcode == ACK:
            assert reply.offset == len(got)
            got, count = got + reply.data, count + 1
            if reply.burst_complete:
                break
            reply = receive(station)
        lengths.append(count)
        next(itertools.islice(SEQUENCES, count, None))
    assert (got == content, lengths) == (True, [168, -(-len(content) // LARGEST) - 168])


def test_none_gets_an_ack_and_nothing_else(station: Any) -> None:
    assert ask(station, NONE).opcode == ACK
