"""Log download: list, data, erase (https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST).

PX4: mavlink_log_handler.cpp. A log's id is its place in the list that was last asked for, so nothing is sent before a
list was. PX4's ways, all of them: no entry at all where there are no logs; a list goes from `start` to the last log
whatever `end` says; a piece of a log is sent in full packets, so that it may go beyond what was asked for; a request
that can't be met is not answered; logs come and go while armed, too.
"""

import contextlib
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Final, NamedTuple

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.storage.file_system import DiskFile
from sitl_emu.core import dialect as mavlink

ALL: Final = 0xFFFF
"""LOG_REQUEST_LIST.end for every log."""
DATA_BYTES: Final = 90
DATA = struct.Struct("<IHB90s")
"""LOG_DATA in wire order: offset, id, count, data."""
WINDOW: Final = 512
"""Packets that QGroundControl and MAVSDK ask for at a time; they fit into any reader's buffer."""
PACKETS_PER_TICK: Final = 48
"""As long as a request is within the window."""
PACKETS_PER_TICK_BEYOND: Final = 12
"""A datagram each tick: a client that asks for a whole log at once must keep up, and streams go on between."""
UINT32: Final = 0xFFFFFFFF


class Log(NamedTuple):
    """One file of the list."""

    path: Path
    size: int
    """When it was listed."""
    time_utc: int


class Sending:
    """What is being sent on a link, and of which list."""

    def __init__(self) -> None:
        self.logs: list[Log] | None = None
        """None: no list was asked for yet."""
        self.last_id = 0
        self.next_id: int | None = None
        """The entry of the list to be sent next; None: the list is sent."""
        self.file: DiskFile | None = None
        """The log that is being sent."""
        self.id = self.begin = self.offset = self.end = self.size = 0

    def stop(self) -> None:
        """Send nothing more."""
        self.next_id = self.file = None


class LogTransfer:
    """Serves the logs in the instance's folder, on each link by itself."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_LOG_REQUEST_LIST,
            mavlink.MAVLINK_MSG_ID_LOG_REQUEST_DATA,
            mavlink.MAVLINK_MSG_ID_LOG_REQUEST_END,
            mavlink.MAVLINK_MSG_ID_LOG_ERASE,
        }
    )
    HAS_TIMER = True

    def __init__(self, root: Path | None) -> None:
        """`root` is the folder of this instance."""
        self._folder = None if root is None else root / storage.LOG
        self._sendings: dict[Link, Sending] = {}
        self._active: list[tuple[Link, Sending]] = []

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Act on a request, whoever it is for (PX4 does not look), and begin to answer at once."""
        sending = self._sendings.setdefault(link, Sending())
        number = message.get_msgId()
        if number == mavlink.MAVLINK_MSG_ID_LOG_REQUEST_LIST:
            self._request_list(message, sending)
        else:
            sending.stop()
            if number == mavlink.MAVLINK_MSG_ID_LOG_REQUEST_DATA:
                _request_data(message, sending)
            elif number == mavlink.MAVLINK_MSG_ID_LOG_ERASE:
                _erase(self._folder)
        _send(link, sending)
        self._active = [(each, state) for each, state in self._sendings.items() if _busy(state)]

    def on_time(self, now_us: int) -> None:
        """Go on."""
        if not self._active:
            return
        for link, sending in self._active:
            _send(link, sending)
        self._active = [(link, sending) for link, sending in self._active if _busy(sending)]

    def _request_list(self, message: Any, sending: Sending) -> None:
        logs = _logs_in(self._folder)
        if logs is None:
            return
        sending.stop()
        sending.logs, sending.next_id = logs, message.start
        sending.last_id = len(logs) if message.end == ALL else message.end


def _busy(sending: Sending) -> bool:
    return sending.next_id is not None or sending.file is not None


def _folders_in(folder: Path | None) -> list[Path]:
    try:
        return [] if folder is None else sorted(each for each in folder.iterdir() if _is(each.is_dir, each))
    except OSError:
        return []


def _erase(folder: Path | None) -> None:
    """Remove everything in a folder, but for hidden folders and links."""
    if folder is None:
        return
    for inner in _folders_in(folder):
        if not inner.name.startswith("."):
            _erase(inner)
            with contextlib.suppress(OSError):  # it is not ours to remove, or something is left in it
                inner.rmdir()
    with contextlib.suppress(OSError):
        for path in [each for each in folder.iterdir() if _is(each.is_file, each)]:
            path.unlink()


def _logs_in(folder: Path | None) -> list[Log] | None:
    """All files in the folders of a folder, the oldest first, as their names sort; None if there is no such folder."""
    if folder is None or not folder.is_dir():
        return None
    logs = []
    for day in _folders_in(folder):
        try:
            for path in sorted(each for each in day.iterdir() if _is(each.is_file, each)):
                found = path.stat()
                logs.append(Log(path, found.st_size, int(found.st_mtime)))
        except OSError:
            continue  # it can't be read, or was removed just now
    return logs[:ALL]


def _is(kind: Callable[[], bool], path: Path) -> bool:
    """Whether a path is of a kind by itself: links may lead out of the folder."""
    return kind() and not path.is_symlink()


def _request_data(message: Any, sending: Sending) -> None:
    logs = sending.logs
    if logs is None or message.id >= len(logs):
        return
    log = logs[message.id]
    if message.ofs >= log.size:
        return
    try:
        sending.file = DiskFile(log.path, os.O_RDONLY)
    except OSError:
        return
    sending.id, sending.begin, sending.offset, sending.size = message.id, message.ofs, message.ofs, log.size
    # PX4 adds in 32 bits: "everything" from beyond the start on is a single packet
    sending.end = (message.ofs + message.count) & UINT32


def _send(link: Link, sending: Sending) -> None:
    """Send as much as one tick takes."""
    if sending.next_id is not None:
        _send_entries(link, sending)
    elif sending.file is not None:
        _send_data(link, sending, sending.file)


def _send_entries(link: Link, sending: Sending) -> None:
    logs, first = sending.logs or [], sending.next_id or 0
    for number in range(first, min(first + PACKETS_PER_TICK, len(logs))):
        log = logs[number]
        message_id = mavlink.MAVLINK_MSG_ID_LOG_ENTRY
        link.send_fields(message_id, log.time_utc, log.size & UINT32, number, len(logs), sending.last_id)
    sending.next_id = first + PACKETS_PER_TICK if first + PACKETS_PER_TICK < len(logs) else None


def _send_data(link: Link, sending: Sending, file: DiskFile) -> None:
    codec = link.codec(mavlink.MAVLINK_MSG_ID_LOG_DATA)
    within = sending.offset - sending.begin < WINDOW * DATA_BYTES
    packets = PACKETS_PER_TICK if within else PACKETS_PER_TICK_BEYOND
    try:
        data = file.read(sending.offset, min(DATA_BYTES * packets, sending.size - sending.offset))
    except OSError:
        data = b""
    if not data:  # somebody cut the file
        sending.file = None
    for begin in range(0, len(data), DATA_BYTES):
        piece = data[begin : begin + DATA_BYTES]
        link.send_payload(codec, DATA.pack(sending.offset, sending.id, len(piece), piece))
        sending.offset += len(piece)
        if sending.offset >= sending.end or sending.offset >= sending.size:
            sending.file = None
            return
