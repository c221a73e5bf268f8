"""MAVLink FTP's client half: list a folder, get, put and remove a file, ask for its CRC.

Source: https://mavlink.io/en/services/ftp.html and PX4 v1.18: one session per link (0), packets of 239 bytes, bursts of
at most 168 packets, answers numbered one after their request. What is lost is asked for again: a request with its own
number, which the server answers without doing it twice, and of a burst the pieces that did not come.
"""

import struct
import zlib
from collections.abc import Generator
from typing import NamedTuple

from sitl_emu.core import dialect as mavlink

TIMEOUT_US = 300_000
TRIES = 20
DATA_BYTES = 239
PAYLOAD_BYTES = 251
HEADER = struct.Struct("<HBBBBBBI")
SIZE = struct.Struct("<I")
ACK, NAK = 128, 129
TERMINATE, RESET, LIST, OPEN_RO, READ, CREATE, WRITE, REMOVE = 1, 2, 3, 4, 5, 6, 7, 8
CRC32, BURST = 14, 15
FAIL_ERRNO, EOF = 2, 6
SEQUENCE_PERIOD_US = 1_000
"""A conversation begins with the number of the millisecond in which it begins."""
BURST_NUMBERS = 256
"""More than the sequence numbers that a burst uses up."""
WORTH_A_BURST = 4
"""Fewer missing pieces in a row are read one by one."""
NO_ANSWER = "no answer"
NO_PROGRESS = "no more of it comes"
"""The error of a file that has become shorter than it was when it was opened."""
ERRORS = {
    1: "failed",
    2: "failed",
    3: "wrong size of the request",
    4: "the file is not open",
    5: "another file is open",
    6: "beyond the end of the file",
    7: "not known to the vehicle",
    8: "exists already",
    9: "protected",
    10: "not found",
}
"""MAV_FTP_ERR for people."""


class Entry(NamedTuple):
    """A file or folder in a folder."""

    name: str
    is_folder: bool
    size: int = 0


class Request(NamedTuple):
    """What to ask for."""

    opcode: int
    data: bytes = b""
    offset: int = 0
    size: int | None = None
    """None: the length of the data."""


class Reply(NamedTuple):
    """An answer, decoded."""

    sequence: int
    opcode: int
    req_opcode: int
    burst_complete: bool
    offset: int
    data: bytes


class RefusedError(Exception):
    """The vehicle said no; the text says why."""

    def __init__(self, reply: Reply) -> None:
        self.code = reply.data[0] if reply.data else 0
        text = ERRORS.get(self.code, f"error {self.code}")
        super().__init__(f"{text} (errno {reply.data[1]})" if self.code == FAIL_ERRNO else text)


Steps = Generator[Request | None, Reply | None, None]
"""A conversation: yields what to ask (None: listen on) and is sent the answer (None: a burst went silent)."""
Answer = Generator[Request | None, Reply | None, Reply]
"""The part of a conversation that ends with an answer."""


class Transfer:
    """What all of them share: one request at a time, asked again until it is answered.

    `done` tells the end, `error` what went wrong, if anything did.
    """

    def __init__(self, target_system: int, path: str, target_component: int = 1) -> None:
        self.target = (target_system, target_component)
        self.path = path
        self.error: str | None = None
        self.done = False
        self._steps = self._talk()
        self._request: Request | None = None
        self._sequence = 0
        self._tries = 0
        self._due_us = 0

    def _talk(self) -> Steps:
        """The conversation. May raise RefusedError."""
        raise NotImplementedError

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the answer to what was asked last; returns the next request."""
        request = self._request
        if self.done or request is None or msg.get_type() != "FILE_TRANSFER_PROTOCOL":
            return []
        if (msg.get_srcSystem(), msg.get_srcComponent()) != self.target:
            return []
        reply = decode(bytes(msg.payload))
        if reply.req_opcode != request.opcode:
            return []
        if (reply.sequence - self._sequence - 1) & 0xFFFF >= self._numbers_used():
            return []
        self._tries = 0
        return self._advance(now_us, reply)

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Sends the first request, and again what was not answered."""
        if self.done or (self._request is not None and now_us < self._due_us):
            return []
        if self._request is None:
            # Not the numbers of an earlier conversation: the server would take ours for a request that comes again.
            self._sequence = now_us // SEQUENCE_PERIOD_US & 0xFFFF
            return self._advance(now_us, None)
        if self._tries >= TRIES:
            self.error, self.done = NO_ANSWER, True
            return []
        if self._request.opcode == BURST:
            return self._advance(now_us, None)
        return self._send(now_us)

    def _advance(self, now_us: int, reply: Reply | None) -> list[mavlink.MAVLink_message]:
        self._due_us = now_us + TIMEOUT_US
        try:
            request = self._steps.send(reply)
        except StopIteration:
            self.done = True
            return []
        except RefusedError as refusal:
            self.error, self.done = str(refusal), True
            return []
        if request is None:
            return []
        self._sequence = (self._sequence + 1 + self._numbers_used()) & 0xFFFF
        self._request = request
        return self._send(now_us)

    def _numbers_used(self) -> int:
        """How many sequence numbers the answers to the last request can take."""
        return BURST_NUMBERS if self._request is not None and self._request.opcode == BURST else 1

    def _send(self, now_us: int) -> list[mavlink.MAVLink_message]:
        assert self._request is not None
        self._tries += 1
        self._due_us = now_us + TIMEOUT_US
        payload = encode(self._sequence, self._request)
        return [mavlink.MAVLink_file_transfer_protocol_message(0, *self.target, list(payload))]

    def _ask(self, opcode: int, data: bytes = b"", offset: int = 0, size: int | None = None) -> Answer:
        """One request and its ACK. Raises RefusedError."""
        reply = yield Request(opcode, data, offset, size)
        assert reply is not None
        if reply.opcode != ACK:
            raise RefusedError(reply)
        return reply


class FtpList(Transfer):
    """The `entries` of a folder."""

    def __init__(self, target_system: int, path: str, target_component: int = 1) -> None:
        super().__init__(target_system, path, target_component)
        self.entries: list[Entry] = []

    def _talk(self) -> Steps:
        count = 0
        while True:
            try:
                reply = yield from self._ask(LIST, self.path.encode(), offset=count)
            except RefusedError as refusal:
                if refusal.code == EOF:
                    return
                raise
            lines = reply.data.split(b"\0")[:-1]
            if not lines:
                return
            count += len(lines)
            self.entries += [entry for line in lines if (entry := entry_of(line)) is not None]


class FtpGet(Transfer):
    """A file's `content` as long as it was when it was opened, once it is done without an error.

    What is written to it meanwhile, as to the log of a vehicle that is not switched off, is left.
    """

    def __init__(self, target_system: int, path: str, target_component: int = 1) -> None:
        super().__init__(target_system, path, target_component)
        self.content = b""
        self.size: int | None = None

    def _talk(self) -> Steps:
        yield from self._ask(RESET)
        opened = yield from self._ask(OPEN_RO, self.path.encode())
        self.size = size = SIZE.unpack_from(opened.data)[0]
        content = bytearray(size)
        missing = set(range(-(-size // DATA_BYTES)))
        in_vain = 0
        while missing:
            if in_vain == TRIES:
                self.error = NO_PROGRESS
                return
            first, before = min(missing), len(missing)
            if missing.issuperset(range(first, first + WORTH_A_BURST)):
                yield from self._burst(first, content, missing)
            else:
                offset = first * DATA_BYTES
                reply = yield from self._ask(READ, offset=offset, size=min(DATA_BYTES, size - offset))
                put_piece(reply, content, missing)
            in_vain = in_vain + 1 if len(missing) == before else 0
        yield from self._ask(TERMINATE)
        self.content = bytes(content)

    def _burst(self, first: int, content: bytearray, missing: set[int]) -> Steps:
        """Ask for a burst and take what comes of it."""
        reply = yield Request(BURST, offset=first * DATA_BYTES, size=DATA_BYTES)
        while reply is not None and reply.opcode == ACK:
            put_piece(reply, content, missing)
            if reply.burst_complete or not missing:
                return
            reply = yield None
        if reply is not None and reply.data[0] != EOF:
            raise RefusedError(reply)


class FtpPut(Transfer):
    """Writes a file, new or in place of an old one, and compares its CRC."""

    def __init__(self, target_system: int, path: str, content: bytes, target_component: int = 1) -> None:
        super().__init__(target_system, path, target_component)
        self.content = content
        self.written = 0

    def _talk(self) -> Steps:
        yield from self._ask(RESET)
        yield from self._ask(CREATE, self.path.encode())
        while self.written < len(self.content):
            piece = self.content[self.written : self.written + DATA_BYTES]
            reply = yield from self._ask(WRITE, piece, offset=self.written)
            written = SIZE.unpack_from(reply.data)[0]
            if written == 0:
                self.error = "nothing more could be written"
                return
            self.written += written
        yield from self._ask(TERMINATE)
        reply = yield from self._ask(CRC32, self.path.encode())
        if SIZE.unpack_from(reply.data)[0] != crc_of(self.content):
            self.error = "what was written is not what was sent"


class FtpRemove(Transfer):
    """Removes a file."""

    def _talk(self) -> Steps:
        yield from self._ask(REMOVE, self.path.encode())


class FtpCrc(Transfer):
    """The `crc` of a file, as `crc_of` calculates it."""

    def __init__(self, target_system: int, path: str, target_component: int = 1) -> None:
        super().__init__(target_system, path, target_component)
        self.crc: int | None = None

    def _talk(self) -> Steps:
        reply = yield from self._ask(CRC32, self.path.encode())
        self.crc = SIZE.unpack_from(reply.data)[0]


def crc_of(content: bytes) -> int:
    """MAVLink FTP's CRC-32: zero at first, no inversion at the end."""
    return zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


def encode(sequence: int, request: Request) -> bytes:
    """The payload of a request."""
    size = len(request.data) if request.size is None else request.size
    head = HEADER.pack(sequence, 0, request.opcode, size, 0, 0, 0, request.offset)
    return (head + request.data).ljust(PAYLOAD_BYTES, b"\0")


def decode(payload: bytes) -> Reply:
    """What an answer's payload says."""
    sequence, _, opcode, size, req_opcode, complete, _, offset = HEADER.unpack_from(payload)
    data = payload[HEADER.size : HEADER.size + size]
    return Reply(sequence, opcode, req_opcode, bool(complete), offset, data)


def entry_of(line: bytes) -> Entry | None:
    """An entry of a listing; None for what a listing skips."""
    text = line.decode(errors="replace")
    name, _, size = text[1:].partition("\t")
    if text.startswith("D"):
        return Entry(name, True)
    if text.startswith("F"):
        return Entry(name, False, int(size) if size.isdigit() else 0)
    return None


def put_piece(reply: Reply, content: bytearray, missing: set[int]) -> None:
    """Lay a piece of a file where it belongs; one that is cut short stays missing, and what is too much is left."""
    end = min(reply.offset + DATA_BYTES, len(content))
    if reply.offset % DATA_BYTES == 0 and reply.offset < end <= reply.offset + len(reply.data):
        content[reply.offset : end] = reply.data[: end - reply.offset]
        missing.discard(reply.offset // DATA_BYTES)
