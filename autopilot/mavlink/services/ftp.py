"""MAVLink FTP, the server (https://mavlink.io/en/services/ftp.html; PX4: mavlink_ftp.cpp).

Serves the folder of the instance, and under `etc/extras` the files of component_metadata/. One session per link, which
ends after 10 s without a request. A request with the number of the last one, from the same sender, gets the last
answer again, as long as that was a short one. A read is answered at once; a burst begins at once and goes on with the
ticks, as does the CRC of a long file.
"""

import errno
import os
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Final, NamedTuple

from sitl_emu.autopilot.mavlink.component_metadata import files
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.service import is_for
from sitl_emu.autopilot.storage.file_system import Entry, FileSystem, OpenFile, ProtectedError, Tree
from sitl_emu.core import dialect as mavlink

HEADER = struct.Struct("<HBBBBBBI")
SIZE = struct.Struct("<I")
DATA_BYTES: Final = 239
PAYLOAD_BYTES: Final = HEADER.size + DATA_BYTES
"""What is not used of it is zero, so that MAVLink leaves it out; only an answer that is sent again still bears the rest
of its request (MavlinkFTP::_reply)."""
PATH_BYTES: Final = 238
ACK, NAK = 128, 129
NONE, TERMINATE, RESET, LIST, OPEN_RO, READ, CREATE, WRITE, REMOVE, MKDIR, RMDIR = range(11)
OPEN_WO, TRUNCATE, RENAME, CRC32, BURST, LIST_WITH_TIME = range(11, 17)
FAIL_ERRNO, INVALID_DATA_SIZE, INVALID_SESSION, NO_SESSIONS, EOF = 2, 3, 4, 5, 6
UNKNOWN_COMMAND, FILE_EXISTS, FILE_PROTECTED, FILE_NOT_FOUND = 7, 8, 9, 10
"""MAV_FTP_ERR."""
OPEN_FLAGS = {
    OPEN_RO: os.O_RDONLY,
    OPEN_WO: os.O_CREAT | os.O_WRONLY,
    CREATE: os.O_CREAT | os.O_TRUNC | os.O_WRONLY,
}
SESSION: Final = 0
"""The only session there is."""
KEPT_BYTES: Final = 4
"""Answers up to so long are kept for a request that comes again; longer ones only read, and are made anew. So are those
that begin as NO_SESSIONS does: a size that ends in that byte is none, but PX4 takes it for one (MavlinkFTP::_reply).
"""
IDLE_US: Final = 10_000_000
BURST_BYTES: Final = 35_000
"""A burst ends with the first batch that goes beyond; the reader asks for the next."""
BATCH_PACKETS: Final = 24
"""Packets that PX4's UDP buffer takes at a time. Each is full, whatever size was asked for."""
SHORTEST_REST: Final = 2
"""A new path follows the old one where there are more bytes than these behind it: one letter alone is none."""
CRC_PIECE_BYTES = 1 << 20
"""How much of a file a CRC covers before the tick must go on."""
LARGEST_SKIP = (1 << 31) - 1
"""PX4 counts the entries to skip in an int: a larger offset skips none."""
LINKS_WITHOUT = frozenset({"gimbal"})
FOLDERS = ("etc/init.d", "etc/init.d-posix")
"""PX4's start scripts are in them; ours are empty."""


class Request(NamedTuple):
    """One decoded request, with who asked."""

    sequence: int
    session: int
    opcode: int
    size: int
    req_opcode: int
    burst_complete: int
    padding: int
    offset: int
    raw: bytes
    """The whole payload: the answer is written into a copy of it."""
    sender: tuple[int, int]

    @property
    def data(self) -> bytes:
        """What the size says is data."""
        return self.raw[HEADER.size : HEADER.size + self.size]

    @property
    def path(self) -> str:
        """The data up to its first zero as a path."""
        return os.fsdecode(self.data[:PATH_BYTES].split(b"\0", 1)[0])


class RefusedError(Exception):
    """A request that gets a NAK."""

    def __init__(self, error: int) -> None:
        """`error` is one of MAV_FTP_ERR."""
        self.error = error


class Burst(NamedTuple):
    """A burst that runs: where it is, and what it has sent."""

    request: Request
    sequence: int
    offset: int
    sent_bytes: int


class Checksum(NamedTuple):
    """A CRC that is being calculated."""

    request: Request
    file: OpenFile
    offset: int
    crc: int


class LinkState:
    """What is remembered of a link."""

    def __init__(self) -> None:
        self.file: OpenFile | None = None
        self.burst: Burst | None = None
        self.checksum: Checksum | None = None
        self.kept_answer: tuple[int, tuple[int, int], bytes] | None = None
        """The last answer with its number and receiver, if it was a short one."""
        self.errno = 0
        """Of the last call that failed. PX4 tells it for some later failures too, and calls all of them FILE_EXISTS
        while it is EEXIST."""
        self.heard_us = 0

    def close(self) -> None:
        """End the session."""
        self.file = self.burst = None


class Ftp:
    """The server; a session per link."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL})
    HAS_TIMER = True

    def __init__(self, system_id: int, root: Path | None, etc: Callable[[], Tree] = files.tree) -> None:
        """`system_id` is ours; `root` is the folder of this instance; `etc` makes the files below `etc/`."""
        self._system_id = system_id
        self._files = FileSystem(root, etc, FOLDERS)
        self._states: dict[Link, LinkState] = {}
        self._handlers: dict[int, Callable[[Request, LinkState], bytes | None]] = {
            NONE: lambda request, state: request.data,
            TERMINATE: self._terminate,
            RESET: self._reset,
            LIST: self._list,
            LIST_WITH_TIME: self._list,
            OPEN_RO: self._open,
            OPEN_WO: self._open,
            CREATE: self._open,
            READ: self._read,
            WRITE: self._write,
            BURST: self._start_burst,
            REMOVE: self._remove,
            MKDIR: self._make_folder,
            RMDIR: self._remove_folder,
            TRUNCATE: self._truncate,
            RENAME: self._rename,
            CRC32: self._start_checksum,
        }

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Answer one request."""
        if link.name in LINKS_WITHOUT or not is_for(message, self._system_id, broadcast=True):
            return
        raw = bytes(message.payload)
        sender = (message.get_srcSystem(), message.get_srcComponent())
        request = Request._make((*HEADER.unpack_from(raw), raw, sender))
        state = self._states.setdefault(link, LinkState())
        state.heard_us = now_us
        if request.size > DATA_BYTES:
            self._refuse(link, state, request, INVALID_DATA_SIZE)
            return
        if state.kept_answer is not None and state.kept_answer[:2] == (request.sequence + 1, request.sender):
            self._send(link, request.sender, state.kept_answer[2])
            return
        state.kept_answer = None
        try:
            handler = self._handlers.get(request.opcode)
            if handler is None:
                raise RefusedError(UNKNOWN_COMMAND)
            data = handler(request, state)
        except RefusedError as refusal:
            self._refuse(link, state, request, refusal.error)
        except ProtectedError:
            self._refuse(link, state, request, FILE_PROTECTED)
        except (OSError, ValueError) as failure:
            state.errno = getattr(failure, "errno", None) or errno.EINVAL
            self._refuse(link, state, request, FAIL_ERRNO)
        else:
            if data is not None:
                self._answer(link, state, request, ACK, data)
            elif request.opcode == BURST:
                self._send_batch(link, state)
            else:
                self._go_on_with_checksum(link, state)

    def on_time(self, now_us: int) -> None:
        """Go on with bursts and CRCs, and close what nobody asks for any more."""
        for link, state in self._states.items():
            if state.burst is not None:
                self._send_batch(link, state)
            if state.checksum is not None:
                self._go_on_with_checksum(link, state)
            if state.file is not None and now_us - state.heard_us > IDLE_US:
                state.close()
                state.kept_answer = None

    # --- sessions ----------------------------------------------------------------------------------------

    def _open(self, request: Request, state: LinkState) -> bytes:
        if state.file is not None:
            raise RefusedError(NO_SESSIONS)
        state.file = self._files.open(request.path, OPEN_FLAGS[request.opcode])
        return SIZE.pack(state.file.size & 0xFFFFFFFF)

    @staticmethod
    def _terminate(request: Request, state: LinkState) -> bytes:
        _session(request, state)
        state.close()
        return b""

    @staticmethod
    def _reset(_request: Request, state: LinkState) -> bytes:
        state.close()
        return b""

    @staticmethod
    def _read(request: Request, state: LinkState) -> bytes:
        file = _session(request, state)
        if request.offset >= file.size:
            raise RefusedError(EOF)
        return file.read(request.offset, request.size)

    @staticmethod
    def _write(request: Request, state: LinkState) -> bytes:
        return SIZE.pack(_session(request, state).write(request.offset, request.data))

    @staticmethod
    def _start_burst(request: Request, state: LinkState) -> None:
        _session(request, state)
        state.burst = Burst(request, request.sequence, request.offset, 0)

    def _send_batch(self, link: Link, state: LinkState) -> None:
        """The next packets of a burst; the one that completes it says so, the end of the file is a NAK."""
        assert state.burst is not None and state.file is not None
        request, sequence, offset, sent_bytes = state.burst
        file = state.file
        for packet in range(1, BATCH_PACKETS + 1):
            asked = request._replace(sequence=sequence & 0xFFFF, offset=offset, burst_complete=0)
            try:
                data = file.read(offset, DATA_BYTES) if offset < file.size else b""
            except OSError:
                state.burst = None
                self._answer(link, state, asked, NAK, bytes((FAIL_ERRNO, state.errno & 0xFF)))
                return
            if not data:
                state.burst = None
                self._answer(link, state, asked, NAK, bytes((EOF,)))
                return
            sequence, offset, sent_bytes = sequence + 1, offset + len(data), sent_bytes + len(data)
            complete = packet == BATCH_PACKETS and sent_bytes > BURST_BYTES
            self._answer(link, state, asked, ACK, data, int(complete))
        state.burst = None if complete else Burst(request, sequence, offset, sent_bytes)

    # --- folders and files -------------------------------------------------------------------------------

    def _list(self, request: Request, state: LinkState) -> bytes:
        try:
            entries = self._files.entries(request.path)
        except OSError as failure:
            state.errno = failure.errno or 0
            raise RefusedError(FILE_NOT_FOUND) from None
        data = b""
        for entry in entries[request.offset if request.offset <= LARGEST_SKIP else 0 :]:
            line = _line(entry, request.opcode == LIST_WITH_TIME)
            if len(data) + len(line) > DATA_BYTES:
                return data
            data += line
        state.errno = 0
        if not data and request.offset:
            raise RefusedError(EOF)
        return data

    def _remove(self, request: Request, _state: LinkState) -> bytes:
        self._files.remove(request.path)
        return b""

    def _make_folder(self, request: Request, _state: LinkState) -> bytes:
        self._files.make_folder(request.path)
        return b""

    def _remove_folder(self, request: Request, _state: LinkState) -> bytes:
        self._files.remove_folder(request.path)
        return b""

    def _truncate(self, request: Request, _state: LinkState) -> bytes:
        try:
            self._files.truncate(request.path, request.offset)
        except OSError:
            raise RefusedError(FAIL_ERRNO) from None  # PX4 tells the errno of an earlier failure
        return b""

    def _rename(self, request: Request, _state: LinkState) -> bytes:
        old, _, rest = request.data.partition(b"\0")
        if len(old) + SHORTEST_REST >= request.size:
            raise RefusedError(FAIL_ERRNO)
        self._files.rename(os.fsdecode(old), os.fsdecode(rest.split(b"\0", 1)[0]))
        return b""

    def _start_checksum(self, request: Request, state: LinkState) -> None:
        try:
            file = self._files.open(request.path, os.O_RDONLY)
        except OSError:
            raise RefusedError(FAIL_ERRNO) from None  # as in _truncate
        if state.checksum is None or state.checksum.request != request:
            state.checksum = Checksum(request, file, 0, 0xFFFFFFFF)

    def _go_on_with_checksum(self, link: Link, state: LinkState) -> None:
        """CRC-32 with zero as its first value and without inversion at the end, over the next piece of the file."""
        assert state.checksum is not None
        request, file, offset, crc = state.checksum
        try:
            data = file.read(offset, CRC_PIECE_BYTES)
        except OSError as failure:
            state.checksum = None
            state.errno = failure.errno or 0
            self._refuse(link, state, request, FAIL_ERRNO)
            return
        crc = zlib.crc32(data, crc)
        if len(data) == CRC_PIECE_BYTES:
            state.checksum = Checksum(request, file, offset + len(data), crc)
        else:
            state.checksum = None
            self._answer(link, state, request, ACK, SIZE.pack(crc ^ 0xFFFFFFFF))

    # --- answers -----------------------------------------------------------------------------------------

    def _refuse(self, link: Link, state: LinkState, request: Request, error: int) -> None:
        if state.errno == errno.EEXIST:
            error = FILE_EXISTS
        elif state.errno == errno.ENOENT and error == FAIL_ERRNO:
            error = FILE_NOT_FOUND
        data = bytes((error, state.errno & 0xFF)) if error == FAIL_ERRNO else bytes((error,))
        self._answer(link, state, request, NAK, data)

    def _answer(
        self,
        link: Link,
        state: LinkState,
        request: Request,
        opcode: int,
        data: bytes,
        burst_complete: int | None = None,
    ) -> None:
        sequence = (request.sequence + 1) & 0xFFFF
        session = SESSION if request.opcode in OPEN_FLAGS and opcode == ACK else request.session
        complete = request.burst_complete if burst_complete is None else burst_complete
        head = HEADER.pack(
            sequence, session, opcode, len(data), request.opcode, complete, request.padding, request.offset
        )
        kept = head + data + request.raw[len(head) + len(data) :]
        if len(data) <= KEPT_BYTES and kept[len(head)] != NO_SESSIONS:
            state.kept_answer = sequence, request.sender, kept
        self._send(link, request.sender, (head + data).ljust(PAYLOAD_BYTES, b"\0"))

    @staticmethod
    def _send(link: Link, receiver: tuple[int, int], payload: bytes) -> None:
        codec = link.codec(mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL)
        link.send_payload(codec, bytes((0, *receiver)) + payload)


def _session(request: Request, state: LinkState) -> OpenFile:
    """The open file. Raises RefusedError."""
    if request.session != SESSION or state.file is None:
        raise RefusedError(INVALID_SESSION)
    return state.file


def _line(entry: Entry, with_time: bool) -> bytes:
    if entry.kind == "S":
        text = "S"
    elif entry.kind == "D":
        text = f"D{entry.name}"
    elif with_time:
        text = f"F{entry.name}\t{entry.size}\t{entry.modified_s}"
    else:
        text = f"F{entry.name}\t{entry.size}"
    return os.fsencode(text) + b"\0"
