"""The FTP server on simulated time, over a folder of its own; the answers are PX4's (measured, or mavlink_ftp.cpp)."""

import itertools
import os
import random
import struct
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from sitl_emu.autopilot.mavlink.encoder import Encoder
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.ftp import Ftp
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports

HEADER = struct.Struct("<HBBBBBBI")
ACK, NAK = 128, 129
NONE, TERMINATE, RESET, LIST, OPEN_RO, READ, CREATE, WRITE, REMOVE, MKDIR, RMDIR = range(11)
OPEN_WO, TRUNCATE, RENAME, CRC32, BURST, LIST_WITH_TIME = range(11, 17)
ERRNO, BAD_SIZE, BAD_SESSION, NO_SESSION, EOF, UNKNOWN, EXISTS, PROTECTED, NOT_FOUND = range(2, 11)
EBADF, EISDIR, ENOTEMPTY = 9, 21, 39
TICK_US = 4_000
ETC = {"etc/extras/one.json.xz": b"1" * 1000, "etc/extras/two.json.xz": b"22"}


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

    @property
    def said(self) -> str:
        """`ACK`, or `NAK` with its numbers."""
        return "ACK" if self.opcode == ACK else " ".join(["NAK", *(str(byte) for byte in self.data)])


class Station:
    """A ground station on one link of a server."""

    def __init__(self, root: Path | None, link: str = "gcs") -> None:
        self.rest = b""
        """What the last answer's payload holds behind its data."""
        self.server = Ftp(1, root, lambda: ETC)
        self.link = Link(link, "normal", ports.gcs(0), Encoder(1))
        self.parser = mavlink.MAVLink(None)
        self.now_us = 0
        self.sequences = itertools.count(10, 2)

    def ask_all(
        self,
        opcode: int,
        data: bytes | str = b"",
        *,
        offset: int = 0,
        size: int | None = None,
        session: int = 0,
        sequence: int | None = None,
        target: tuple[int, int] = (1, 1),
        sender: tuple[int, int] = (255, 190),
    ) -> list[Reply]:
        """All that is said at once."""
        body = data.encode() if isinstance(data, str) else data
        number = next(self.sequences) if sequence is None else sequence
        length = len(body) if size is None else size
        head = HEADER.pack(number & 0xFFFF, session, opcode, length, 0, 0, 0, offset)
        message = mavlink.MAVLink_file_transfer_protocol_message(0, *target, list((head + body).ljust(251, b"\0")))
        message.pack(mavlink.MAVLink(None, *sender))
        self.server.on_message(self.now_us, message, self.link)
        return self.heard(sender)

    def ask(self, opcode: int, data: bytes | str = b"", **more: Any) -> Reply:
        """The one answer."""
        (reply,) = self.ask_all(opcode, data, **more)
        return reply

    def wait(self, seconds: float) -> list[Reply]:
        """What is said while time passes."""
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.now_us += TICK_US
            self.server.on_time(self.now_us)
        return self.heard()

    def heard(self, station: tuple[int, int] = (255, 190)) -> list[Reply]:
        self.link.flush()
        messages = [m for data in self.link.outbox for m in self.parser.parse_buffer(data) or []]
        self.link.outbox.clear()
        replies = []
        for message in messages:
            assert (message.target_system, message.target_component) == station
            raw = bytes(message.payload)
            head = HEADER.unpack_from(raw)
            replies.append(Reply._make((*head, raw[12 : 12 + head[3]])))
            self.rest = raw[12 + head[3] :]
        return replies


@pytest.fixture
def root(tmp_path: Path) -> Path:
    folder = tmp_path / "root"
    folder.mkdir()
    return folder


@pytest.fixture
def station(root: Path) -> Station:
    return Station(root)


def crc(content: bytes) -> bytes:
    return struct.pack("<I", zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF)


def test_a_file_is_created_written_and_read_back(station: Station, root: Path) -> None:
    assert station.ask(MKDIR, "plans").said == "ACK"
    assert station.ask(CREATE, "plans/file.txt").data == bytes(4)
    assert station.ask(WRITE, b"0123456789").data.hex() == "0a000000"
    assert station.ask(WRITE, b"xyz", offset=20).data.hex() == "03000000"
    assert station.ask(TERMINATE).said == "ACK"
    content = b"0123456789" + bytes(10) + b"xyz"
    assert (root / "plans" / "file.txt").read_bytes() == content
    assert station.ask(OPEN_RO, "/plans/file.txt").data.hex() == "17000000"
    assert station.ask(READ, size=239).data == content
    assert station.ask(READ, offset=8, size=4).data == b"89\0\0"
    assert station.ask(READ, offset=23, size=1).said == f"NAK {EOF}"
    assert station.ask(CRC32, "plans/file.txt").data == crc(content)


def test_the_writing_steps_that_were_measured_on_px4(station: Station) -> None:
    steps: list[tuple[int, bytes | str, int | None, int]] = [
        (MKDIR, "probe", None, 0),
        (MKDIR, "probe", None, 0),
        (CREATE, "probe/file", None, 0),
        (WRITE, b"0123456789", None, 0),
        (TERMINATE, "", None, 0),
        (OPEN_WO, "probe/file", None, 0),
        (READ, "", 5, 0),
        (TERMINATE, "", None, 0),
        (TRUNCATE, "probe/file", None, 5),
        (TRUNCATE, "probe/none", None, 5),
        (CRC32, "probe/none", None, 0),
        (RMDIR, "probe", None, 0),
        (RENAME, "probe/file\0probe/other\0", None, 0),
        (RENAME, "probe/file\0probe/x\0", None, 0),
        (REMOVE, "probe/file", None, 0),
        (REMOVE, "probe", None, 0),
        (REMOVE, "probe/other", None, 0),
        (RMDIR, "probe", None, 0),
        (RMDIR, "probe", None, 0),
        (CREATE, "no_such_dir/file", None, 0),
    ]
    said = [station.ask(opcode, data, size=size, offset=offset).said for opcode, data, size, offset in steps]
    assert said == [
        "ACK",
        f"NAK {EXISTS}",
        "ACK",
        "ACK",
        "ACK",
        "ACK",
        f"NAK {ERRNO} {EBADF}",
        "ACK",
        "ACK",
        f"NAK {ERRNO} {EBADF}",
        f"NAK {ERRNO} {EBADF}",
        f"NAK {ERRNO} {ENOTEMPTY}",
        "ACK",
        f"NAK {NOT_FOUND}",
        f"NAK {NOT_FOUND}",
        f"NAK {ERRNO} {EISDIR}",
        "ACK",
        "ACK",
        f"NAK {NOT_FOUND}",
        f"NAK {NOT_FOUND}",
    ]


def test_while_the_last_failure_was_that_something_exists_every_refusal_says_so(station: Station) -> None:
    station.ask(MKDIR, "work")
    assert station.ask(MKDIR, "work").said == f"NAK {EXISTS}"
    assert station.ask(READ, size=1).said == f"NAK {EXISTS}"
    assert station.ask(LIST, "").said == "ACK"
    assert station.ask(READ, size=1).said == f"NAK {BAD_SESSION}"


def test_a_folder_can_be_opened_but_not_read(station: Station) -> None:
    for folder in ("", "etc", "etc/extras"):
        assert station.ask(OPEN_RO, folder).said == "ACK"
        assert station.ask(READ, size=10).said == f"NAK {ERRNO} {EISDIR}"
        assert station.ask(WRITE, b"abc").said == f"NAK {ERRNO} {EBADF}"
        assert station.ask(BURST, size=239).said == f"NAK {ERRNO} {EBADF}"
        assert station.ask(TERMINATE).said == "ACK"


def test_lists(station: Station, root: Path) -> None:
    (root / "log").mkdir()
    (root / "parameters.bson").write_bytes(b"12345")
    (root / "link").symlink_to("log")
    os.utime(root / "parameters.bson", (1_700_000_000, 1_700_000_000))
    assert station.ask(LIST, "").data == b"S\0S\0Dlog\0Fparameters.bson\t5\0S\0S\0"
    assert station.ask(LIST, "/").data == station.ask(LIST, "").data
    timed = station.ask(LIST_WITH_TIME, "")
    assert timed.data == b"S\0S\0Dlog\0Fparameters.bson\t5\t1700000000\0S\0S\0"
    assert station.ask(LIST, "etc").data == b"Dextras\0Dinit.d\0Dinit.d-posix\0S\0S\0"
    extras = station.ask(LIST, "etc/extras/")
    assert (extras.data, extras.offset) == (b"Fone.json.xz\t1000\0Ftwo.json.xz\t2\0S\0S\0", 0)
    assert station.ask(LIST, "etc/extras", offset=1).data == b"Ftwo.json.xz\t2\0S\0S\0"
    assert station.ask(LIST, "etc/extras", offset=4).said == f"NAK {EOF}"
    assert station.ask(LIST, "etc/init.d").data == b"S\0S\0"
    for nowhere in ("no_such_dir", "etc/nothing", "etc/extras/one.json.xz", "parameters.bson", "/fs/microsd", "@PARAM"):
        assert station.ask(LIST, nowhere).said == f"NAK {NOT_FOUND}"


def test_a_long_listing_goes_on_from_an_offset(station: Station, root: Path) -> None:
    names = [f"a_file_with_a_name_of_some_length_{number:03}" for number in range(40)]
    for name in names:
        (root / name).touch()
    found: list[str] = []
    while (reply := station.ask(LIST, "", offset=len(found))).said == "ACK":
        found += [entry.decode() for entry in reply.data.split(b"\0")[:-1]]
    assert reply.said == f"NAK {EOF}"
    assert found == [f"F{name}\t0" for name in names] + ["S"] * 3


def test_no_path_leads_out_of_the_folder(station: Station, root: Path) -> None:
    outside = root.parent / "outside"
    outside.mkdir()
    (outside / "secret").write_text("secret")
    (root / "out").symlink_to(outside)
    (root / "out_file").symlink_to(outside / "secret")
    for path in ("../outside", "..", "out", "etc/../..", "a/../../outside"):
        assert station.ask(LIST, path).said == f"NAK {PROTECTED}"
    for path in ("../outside/secret", "out/secret", "out_file", "etc/../../outside/secret", "/../outside/secret"):
        for opcode in (OPEN_RO, OPEN_WO, CREATE, TRUNCATE, CRC32):
            assert station.ask(opcode, path).said == f"NAK {PROTECTED}", (opcode, path)
    for path in ("../outside/secret", "out/secret"):
        for opcode in (REMOVE, MKDIR, RMDIR):
            assert station.ask(opcode, path).said == f"NAK {PROTECTED}", (opcode, path)
        assert station.ask(RENAME, f"{path}\0mine").said == f"NAK {PROTECTED}"
        assert station.ask(RENAME, f"out_file\0{path}").said == f"NAK {PROTECTED}"
    assert station.ask(REMOVE, "out_file").said == "ACK"
    assert (outside / "secret").read_text() == "secret"
    assert [path.name for path in outside.iterdir()] == ["secret"]


def test_etc_can_be_read_and_not_written(station: Station) -> None:
    path = "etc/extras/two.json.xz"
    for opcode in (OPEN_WO, CREATE, TRUNCATE, REMOVE, MKDIR, RMDIR):
        assert station.ask(opcode, path).said == f"NAK {PROTECTED}"
    assert station.ask(RENAME, f"{path}\0mine").said == f"NAK {PROTECTED}"
    assert station.ask(CRC32, path).data == crc(b"22")
    assert station.ask(OPEN_RO, path).said == "ACK"
    assert station.ask(READ, size=239).data == b"22"
    assert station.ask(WRITE, b"x").said == f"NAK {ERRNO} {EBADF}"


def test_without_storage_there_is_etc_and_nothing_else() -> None:
    station = Station(None)
    assert station.ask(LIST, "").data == b"S\0S\0S\0"
    assert station.ask(OPEN_RO, "etc/extras/one.json.xz").said == "ACK"
    station.ask(TERMINATE)
    for opcode in (OPEN_RO, OPEN_WO, CREATE, REMOVE, MKDIR, RMDIR):
        assert station.ask(opcode, "mine").said == f"NAK {NOT_FOUND}"


def test_one_session_a_link_and_each_link_has_its_own(station: Station) -> None:
    path = "etc/extras/one.json.xz"
    assert [station.ask(OPEN_RO, path).said for _ in range(3)] == ["ACK", f"NAK {NO_SESSION}", f"NAK {NO_SESSION}"]
    gcs, station.link = station.link, Link("onboard", "onboard", ports.onboard(0), Encoder(1))
    assert station.ask(OPEN_RO, path).said == "ACK"
    station.link = gcs
    assert station.ask(RESET).said == "ACK"
    assert station.ask(OPEN_RO, path).said == "ACK"
    for opcode in (READ, WRITE, BURST, TERMINATE):
        assert station.ask(opcode, session=5, size=10).said == f"NAK {BAD_SESSION}"
    assert station.ask(TERMINATE).said == "ACK"
    for opcode in (READ, WRITE, BURST, TERMINATE):
        assert station.ask(opcode, size=10).said == f"NAK {BAD_SESSION}"


def test_a_session_ends_after_ten_seconds_of_silence(station: Station) -> None:
    station.ask(OPEN_RO, "etc/extras/one.json.xz")
    station.wait(9.9)
    assert station.ask(READ, size=10).said == "ACK"
    station.wait(10.1)
    assert station.ask(READ, size=10).said == f"NAK {BAD_SESSION}"


def test_a_request_that_comes_again_is_answered_again_and_done_once(station: Station, root: Path) -> None:
    assert [station.ask(MKDIR, "work", sequence=8).said for _ in range(2)] == ["ACK", "ACK"]
    assert station.ask(NONE, sequence=9).sequence == 10
    assert [station.ask(MKDIR, "work", sequence=8).said for _ in range(2)] == [f"NAK {EXISTS}", f"NAK {EXISTS}"]
    assert station.ask(NONE, sequence=65535).sequence == 0
    assert station.ask(RMDIR, "work", sequence=65535).said == "ACK"
    assert not (root / "work").exists()


def test_the_same_number_from_somebody_else_is_another_request(station: Station) -> None:
    assert station.ask(MKDIR, "work", sequence=8).said == "ACK"
    assert station.ask(RMDIR, "work", sequence=8, sender=(254, 190)).said == "ACK"


def test_an_answer_bears_nothing_of_its_request_but_when_it_is_sent_again(station: Station) -> None:
    assert station.ask(MKDIR, "a_long_name", sequence=7).said == "ACK"
    assert station.rest == bytes(239)
    assert station.ask(MKDIR, "a_long_name", sequence=7).said == "ACK"
    assert station.rest.rstrip(b"\0") == b"a_long_name"
    assert station.ask(OPEN_RO, "no_such_file").said == f"NAK {NOT_FOUND}"
    assert station.rest == bytes(238)


def test_a_new_name_of_one_letter_needs_its_zero(station: Station, root: Path) -> None:
    (root / "file").write_text("")
    assert station.ask(RENAME, "file\0b").said == f"NAK {ERRNO} 0"
    assert station.ask(RENAME, "file\0b\0").said == "ACK"
    assert (root / "b").exists()


def test_an_open_that_comes_again_finds_the_session_taken_where_the_size_looks_as_if_it_were(
    station: Station, root: Path
) -> None:
    """5 is NO_SESSION, and PX4 keeps no answer that begins with it."""
    for size, said in ((4, "ACK"), (5, f"NAK {NO_SESSION}"), (256 + 5, f"NAK {NO_SESSION}")):
        (root / "file").write_bytes(b"x" * size)
        assert station.ask(OPEN_RO, "file", sequence=size).said == "ACK"
        assert station.ask(OPEN_RO, "file", sequence=size).said == said
        station.ask(RESET)


def test_the_logs_have_a_name_that_is_everywhere_the_same(station: Station, root: Path) -> None:
    (root / "log").mkdir()
    (root / "log" / "one.ulg").write_bytes(b"123")
    for name in ("@MAV_LOG", "@MAV_LOG/"):
        assert station.ask(LIST, name).data == b"Fone.ulg\t3\0S\0S\0"
    assert station.ask(OPEN_RO, "@MAV_LOG/one.ulg").said == "ACK"
    assert station.ask(LIST, "@MAV_LOGS").said == f"NAK {NOT_FOUND}"
    assert station.ask(LIST, "@MAV_LOG/../..").said == f"NAK {PROTECTED}"


def test_a_read_that_comes_again_reads_again(station: Station, root: Path) -> None:
    (root / "file").write_bytes(b"before")
    station.ask(OPEN_RO, "file", sequence=2)
    assert station.ask(READ, size=6, sequence=4).data == b"before"
    (root / "file").write_bytes(b"after.")
    assert station.ask(READ, size=6, sequence=4).data == b"after."


def test_a_burst_of_a_short_file_ends_with_end_of_file(station: Station) -> None:
    station.ask(OPEN_RO, "etc/extras/one.json.xz")
    replies = station.ask_all(BURST, size=80, sequence=100)
    assert [reply.sequence for reply in replies] == [101, 102, 103, 104, 105, 106]
    assert b"".join(reply.data for reply in replies[:-1]) == b"1" * 1000
    assert [reply.size for reply in replies] == [239, 239, 239, 239, 44, 1]
    assert (replies[-1].said, replies[-1].burst_complete, replies[-1].offset) == (f"NAK {EOF}", 0, 1000)
    assert station.ask(BURST, offset=1000, size=239).said == f"NAK {EOF}"
    assert station.wait(1.0) == []


def test_a_burst_of_what_cannot_be_read_tells_the_last_error_whatever_it_was(station: Station, root: Path) -> None:
    (root / "written").write_bytes(b"some bytes")
    station.ask(OPEN_WO, "written")
    assert station.ask(BURST, size=5).said == "NAK 2 0"
    station.ask(MKDIR, "probe")
    station.ask(MKDIR, "probe")
    assert station.ask(BURST, size=5).said == "NAK 2 17"


def test_a_long_file_comes_in_bursts_of_168_packets(station: Station, root: Path) -> None:
    content = os.urandom(100_000)
    (root / "long").write_bytes(content)
    station.ask(OPEN_RO, "long")
    got = b""
    bursts = []
    while True:
        replies = station.ask_all(BURST, offset=len(got), size=239) + station.wait(0.1)
        got += b"".join(reply.data for reply in replies if reply.opcode == ACK)
        bursts.append((len(replies), sum(reply.burst_complete for reply in replies)))
        if replies[-1].opcode == NAK:
            break
    assert got == content
    assert bursts == [(168, 1), (168, 1), (84, 0)]


def test_a_reset_and_a_new_file_end_a_burst(station: Station, root: Path) -> None:
    (root / "long").write_bytes(bytes(100_000))
    station.ask(OPEN_RO, "long")
    assert len(station.ask_all(BURST, size=239)) == 24
    assert station.ask(RESET).said == "ACK"
    assert station.wait(1.0) == []


def test_the_crc_of_a_long_file_takes_its_time_and_holds_nothing_up(station: Station, root: Path) -> None:
    content = os.urandom(1 << 20) * 3 + b"end"
    (root / "long").write_bytes(content)
    assert station.ask_all(CRC32, "long", sequence=50) == []
    assert station.ask(NONE, sequence=53).said == "ACK"
    (reply,) = station.wait(0.02)
    assert (reply.sequence, reply.data) == (51, crc(content))


def test_what_px4_answers_to_what_is_no_request(station: Station) -> None:
    assert station.ask(LIST, "etc", size=250).said == f"NAK {BAD_SIZE}"
    assert station.ask(READ, size=240).said == f"NAK {BAD_SIZE}"
    for opcode in (17, 50, 127, 128, 129, 255):
        assert station.ask(opcode).said == f"NAK {UNKNOWN}"
    none = station.ask(NONE, b"hello", offset=7)
    assert (none.data, none.offset, none.req_opcode) == (b"hello", 7, NONE)
    assert station.ask(RENAME, "no_second_path").said == f"NAK {ERRNO} 0"
    assert station.ask(OPEN_RO, b"\xff\xfe").said == f"NAK {NOT_FOUND}"
    assert station.ask(OPEN_RO, "x" * 239).said == f"NAK {NOT_FOUND}"
    assert station.ask(LIST, "etc", offset=0xFFFFFFFF).said == "ACK"
    for target in ((2, 1), (1, 2), (1, 190)):
        assert station.ask_all(NONE, target=target) == []
    for target in ((0, 0), (1, 0), (0, 1)):
        assert station.ask(NONE, target=target).said == "ACK"
    assert Station(None, "gimbal").ask_all(NONE) == []


def test_huge_offsets_take_neither_memory_nor_disk(station: Station, root: Path) -> None:
    station.ask(CREATE, "file")
    assert station.ask(WRITE, b"x", offset=0xFFFFFFFF).said == "ACK"
    station.ask(TERMINATE)
    assert (root / "file").stat().st_blocks * 512 < 1 << 20
    assert station.ask(OPEN_RO, "file").data == bytes(4)  # the size is told modulo 2^32, as PX4's uint32_t
    assert station.ask(TRUNCATE, "file", offset=0xFFFFFFFF).said == "ACK"


def test_a_fifo_holds_nothing_up(station: Station, root: Path) -> None:
    os.mkfifo(root / "fifo")
    assert station.ask(OPEN_WO, "fifo").said.startswith("NAK")
    assert station.ask(OPEN_RO, "fifo").said == "ACK"
    assert station.ask(READ, size=10).said == f"NAK {EOF}"
    assert station.ask(LIST, "").data == b"S\0S\0S\0S\0"


def test_the_folder_itself_stays(station: Station, root: Path) -> None:
    assert station.ask(RMDIR, "/").said == "NAK 2 22"
    assert station.ask(RENAME, "/\0other").said == "NAK 2 16"
    assert station.ask(RENAME, "other\0.").said == "NAK 2 16"
    assert station.ask(REMOVE, "").said == f"NAK {ERRNO} {EISDIR}"
    assert station.ask(MKDIR, ".").said == f"NAK {EXISTS}"
    assert root.is_dir()


def test_requests_at_random_break_nothing_and_leave_the_folder_alone_that_is_not_theirs(tmp_path: Path) -> None:
    root, outside = tmp_path / "root", tmp_path / "outside"
    root.mkdir()
    outside.mkdir()
    (root / "out").symlink_to(outside)
    station = Station(root)
    chance = random.Random(11)
    paths = ["", "/", ".", "..", "a", "a/b", "out/x", "../outside/x", "etc/extras/one.json.xz", "x" * 300, "\xff\0y"]
    for _ in range(4000):
        words = chance.choice([chance.choice(paths), f"{chance.choice(paths)}\0{chance.choice(paths)}"]).encode()
        data = chance.choice([words, words, chance.randbytes(30)])
        station.ask_all(
            chance.choice([*range(17), chance.randrange(256)]),
            data[:239],
            offset=chance.choice([0, 1, 239, 5000, 1 << 31, 0xFFFFFFFF]),
            size=chance.choice([None, None, 0, 1, 239, 255]),
            session=chance.choice([0, 0, 0, 1, 255]),
            sequence=chance.randrange(65536),
        )
        station.wait(0.004)
    assert list(outside.iterdir()) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["outside", "root"]
