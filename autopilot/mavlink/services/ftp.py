"""MAVLink FTP, reading side (https://mavlink.io/en/services/ftp.html; PX4: mavlink_ftp.cpp).

Serves the files of component_files.py: list, open, read, burst, CRC, terminate, reset; one session per link, which ends
after 10 s without a request. A request with the number of the last one gets the last answer again. What would write
is refused with FileProtected.
"""

import struct
import zlib
from pathlib import Path
from typing import Any, NamedTuple

from autopilot.mavlink import component_files
from autopilot.mavlink.link import Link
from autopilot.mavlink.services.service import is_for
from sitl_emu.core import dialect as mavlink

HEADER = struct.Struct("<HBBBBBBI")
PAYLOAD_BYTES = 251
DATA_BYTES = 239
ACK, NAK = 128, 129
NONE, TERMINATE, RESET, LIST, OPEN_RO, READ = 0, 1, 2, 3, 4, 5
CREATE, WRITE, REMOVE, MKDIR, RMDIR, OPEN_WO, TRUNCATE, RENAME = 6, 7, 8, 9, 10, 11, 12, 13
CRC32, BURST = 14, 15
WRITING = frozenset({CREATE, WRITE, REMOVE, MKDIR, RMDIR, OPEN_WO, TRUNCATE, RENAME})
INVALID_DATA_SIZE, INVALID_SESSION, NO_SESSIONS, EOF, UNKNOWN_COMMAND = 3, 4, 5, 6, 7
FILE_PROTECTED, FILE_NOT_FOUND, INVALID_PATH = 11, 10, 9
"""MAV_FTP_ERR."""
BURST_PACKETS = 168
"""Packets of one burst, each full whatever size was asked for, as PX4 sends them; the reader asks for the next."""
BURST_PER_TICK = 8
IDLE_US = 10_000_000
LINKS_WITHOUT = frozenset({"gimbal"})


class Request(NamedTuple):
    """One decoded request."""

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
    def path(self) -> str:
        """The data as a path without its leading slash and end."""
        return self.data[: self.size].split(b"\0")[0].decode(errors="replace").strip("/")


class Session:
    """The open file of a link, and its burst if one runs."""

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.burst: Request | None = None
        self.burst_sequence = self.burst_offset = self.burst_left = 0


class LinkState:
    """What is remembered of a link."""

    def __init__(self) -> None:
        self.session: Session | None = None
        self.last_sequence = -1
        self.last_answer: tuple[int, ...] = ()
        self.heard_us = 0


class Ftp:
    """The server; a session per link."""

    MESSAGES = frozenset({mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL})
    HAS_TIMER = True

    def __init__(self, system_id: int, root: Path | None) -> None:
        """`system_id` is ours; `root` is the folder of this instance."""
        self._root = root
        self._system_id = system_id
        self._states: dict[Link, LinkState] = {}
        self._partners: dict[Link, tuple[int, int]] = {}

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Answer one request."""
        if link.name in LINKS_WITHOUT or not is_for(message, self._system_id, broadcast=True):
            return
        raw = bytes(message.payload)
        request = Request._make((*HEADER.unpack_from(raw), raw[HEADER.size :]))
        state = self._states.setdefault(link, LinkState())
        state.heard_us = now_us
        self._partners[link] = (message.get_srcSystem(), message.get_srcComponent())
        if request.sequence == state.last_sequence:
            self._send(link, state.last_answer)
            return
        answer = self._answer(request, state)
        if answer is not None:
            state.last_sequence, state.last_answer = request.sequence, answer
            self._send(link, answer)

    def on_time(self, now_us: int) -> None:
        """Go on with bursts, and close what nobody asks for any more."""
        for link, state in self._states.items():
            session = state.session
            if session is None:
                continue
            if session.burst is not None:
                state.heard_us = now_us
                for _ in range(BURST_PER_TICK):
                    self._burst(link, session)
            elif now_us - state.heard_us > IDLE_US:
                state.session = None

    def _answer(self, request: Request, state: LinkState) -> tuple[int, ...] | None:
        opcode = request.opcode
        if request.size > DATA_BYTES:
            return _nak(request, INVALID_DATA_SIZE)
        if opcode in (NONE, RESET):
            if opcode == RESET:
                state.session = None
            return _reply(request, ACK, b"")
        if opcode == LIST:
            return _list(request)
        if opcode == OPEN_RO:
            return self._open(request, state)
        if opcode == CRC32:
            content = component_files.tree().get(request.path)
            if content is None:
                return _nak(request, FILE_NOT_FOUND)
            return _reply(request, ACK, struct.pack("<I", zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF))
        if opcode in WRITING:
            return _nak(request, FILE_PROTECTED)
        if opcode not in (TERMINATE, READ, BURST):
            return _nak(request, UNKNOWN_COMMAND)
        return self._in_session(request, state)

    @staticmethod
    def _open(request: Request, state: LinkState) -> tuple[int, ...]:
        if state.session is not None:
            return _nak(request, NO_SESSIONS)
        content = component_files.tree().get(request.path)
        if content is None:
            return _nak(request, FILE_NOT_FOUND)
        state.session = Session(content)
        return _reply(request, ACK, struct.pack("<I", len(content)))

    @staticmethod
    def _in_session(request: Request, state: LinkState) -> tuple[int, ...] | None:
        session = state.session
        if request.session != 0 or (session is None and request.opcode != TERMINATE):
            return _nak(request, INVALID_SESSION)
        if request.opcode == TERMINATE:
            state.session = None
            return _reply(request, ACK, b"")
        assert session is not None
        if request.opcode == BURST:
            session.burst, session.burst_left = request, BURST_PACKETS
            session.burst_offset, session.burst_sequence = request.offset, request.sequence
            return None
        if request.offset >= len(session.content):
            return _nak(request, EOF)
        return _reply(request, ACK, session.content[request.offset : request.offset + request.size])

    def _burst(self, link: Link, session: Session) -> None:
        request = session.burst
        if request is None:
            return
        asked = request._replace(sequence=session.burst_sequence, offset=session.burst_offset)
        chunk = session.content[asked.offset : asked.offset + DATA_BYTES]
        session.burst_sequence = (session.burst_sequence + 1) & 0xFFFF
        session.burst_left -= 1
        if not chunk:
            session.burst = None
            self._send(link, _nak(asked, EOF))
            return
        session.burst_offset += len(chunk)
        complete = session.burst_left == 0
        if complete:
            session.burst = None
        self._send(link, _reply(asked, ACK, chunk, burst_complete=int(complete)))

    def _send(self, link: Link, payload: tuple[int, ...]) -> None:
        partner = self._partners[link]
        link.send_fields(mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL, 0, *partner, *payload)


def _reply(request: Request, opcode: int, data: bytes, burst_complete: int = 0) -> tuple[int, ...]:
    sequence = (request.sequence + 1) & 0xFFFF
    head = HEADER.pack(sequence, 0, opcode, len(data), request.opcode, burst_complete, 0, request.offset)
    return tuple((head + data).ljust(PAYLOAD_BYTES, b"\0"))


def _nak(request: Request, error: int) -> tuple[int, ...]:
    return _reply(request, NAK, bytes((error,)))


def _list(request: Request) -> tuple[int, ...]:
    path = request.path
    if ".." in path.split("/"):
        return _nak(request, INVALID_PATH)
    entries = directory(path)
    if not entries:
        return _nak(request, FILE_NOT_FOUND)
    if request.offset >= len(entries):
        return _nak(request, EOF)
    data = b""
    for entry in entries[request.offset :]:
        encoded = entry.encode() + b"\0"
        if len(data) + len(encoded) > DATA_BYTES:
            break
        data += encoded
    return _reply(request, ACK, data)


def directory(path: str) -> list[str]:
    """Entries of a directory as FTP lists them: `F` name, tab, size; `D` name; `S` for `.` and `..`. Empty: none."""
    prefix = f"{path}/" if path else ""
    entries: dict[str, str] = {}
    for name, content in component_files.tree().items():
        if name.startswith(prefix):
            first, *rest = name.removeprefix(prefix).split("/")
            entries[first] = f"D{first}" if rest else f"F{first}\t{len(content)}"
    return ["S", "S", *entries.values()] if entries else []
