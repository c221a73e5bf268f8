"""Log download's client half: list the logs of an autopilot, fetch one, erase all.

Source: https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST and PX4 v1.18: no entry comes where there are no
logs, a piece of a log is sent in full packets of 90 bytes, and a new request ends the one before. A log is fetched in
windows; what of a window is lost is asked for again.
"""

from typing import NamedTuple

from sitl_emu.core import dialect as mavlink

TIMEOUT_US = 300_000
"""Silence after which what is missing is asked for again."""
TRIES = 10
"""Requests without any answer before it ends; PX4 answers nothing where it has nothing."""
DATA_BYTES = 90
WINDOW = 512
"""Packets asked for at a time, so that little comes twice where much is lost."""
WORTH_SKIPPING = 16
"""So many packets in a row that have come end a window; fewer are sent again, which is quicker than to ask twice."""
ALL = 0xFFFF


class LogEntry(NamedTuple):
    """A log on board."""

    id: int
    size: int
    time_utc: int
    """Unix time, s."""


class LogList:
    """Lists the logs; `entries` in the order of their ids, None if the list did not come whole."""

    def __init__(self, target_system: int, target_component: int = 1) -> None:
        self.target = (target_system, target_component)
        self.entries: list[LogEntry] | None = None
        self.done = False
        self._found: dict[int, LogEntry] = {}
        self._count: int | None = None
        self._tries = 0
        self._due_us = 0

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears LOG_ENTRY."""
        if self.done or msg.get_type() != "LOG_ENTRY" or msg.get_srcSystem() != self.target[0]:
            return []
        self._tries, self._due_us, self._count = 1, now_us + TIMEOUT_US, msg.num_logs
        if msg.num_logs:
            self._found[msg.id] = LogEntry(msg.id, msg.size, msg.time_utc)
        self._end_if_whole()
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks for the list, from the first entry that is missing."""
        if self.done or (self._tries and now_us < self._due_us):
            return []
        if self._tries >= TRIES:
            self.done = True
            self.entries = [] if self._count is None else None
            return []
        self._tries += 1
        self._due_us = now_us + TIMEOUT_US
        first = next(number for number in range(ALL) if number not in self._found)
        return [mavlink.MAVLink_log_request_list_message(*self.target, first, ALL)]

    def _end_if_whole(self) -> None:
        if self._count is not None and len(self._found) >= self._count:
            self.entries = [self._found[number] for number in sorted(self._found)]
            self.done = True


class LogDownload:
    """Fetches a log that was listed; `data` is None until it is whole, and stays so if the other end falls silent."""

    def __init__(self, target_system: int, entry: LogEntry, target_component: int = 1) -> None:
        self.target, self.entry = (target_system, target_component), entry
        self.data: bytes | None = None
        self.done = False
        self._content = bytearray(entry.size)
        self._missing = bytearray(b"\1") * -(-entry.size // DATA_BYTES)
        """Per packet, whether it has yet to come."""
        self._left = len(self._missing)
        self._window_end = 0
        self._tries = 0
        self._due_us = 0

    @property
    def progress(self) -> float:
        """0 to 1."""
        return 1.0 - self._left / max(len(self._missing), 1)

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears LOG_DATA; the last packet of a window asks for the next."""
        ours = msg.get_type() == "LOG_DATA" and msg.get_srcSystem() == self.target[0] and msg.id == self.entry.id
        if self.done or not ours:
            return []
        number, inside = divmod(msg.ofs, DATA_BYTES)
        if inside or number >= len(self._missing) or msg.count != min(DATA_BYTES, self.entry.size - msg.ofs):
            return []
        self._tries, self._due_us = 1, now_us + TIMEOUT_US
        if self._missing[number]:
            self._missing[number] = 0
            self._left -= 1
            self._content[msg.ofs : msg.ofs + msg.count] = bytes(msg.data[: msg.count])
        if not self._left:
            return self._end()
        return [self._request(now_us)] if number + 1 >= self._window_end else []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks for the first window, and after a silence for the first that has a gap."""
        if self.done or (self._tries and now_us < self._due_us):
            return []
        if not self._left:
            return self._end()
        if self._tries >= TRIES:
            self.done = True
            return []
        self._tries += 1
        return [self._request(now_us)]

    def _request(self, now_us: int) -> mavlink.MAVLink_message:
        self._due_us = now_us + TIMEOUT_US
        begin = self._missing.index(1)
        limit = min(begin + WINDOW, len(self._missing))
        end = self._missing.find(bytes(WORTH_SKIPPING), begin, limit)
        if end < 0:
            end = self._missing.rindex(1, begin, limit) + 1
        self._window_end = end
        count = (end - begin) * DATA_BYTES
        return mavlink.MAVLink_log_request_data_message(*self.target, self.entry.id, begin * DATA_BYTES, count)

    def _end(self) -> list[mavlink.MAVLink_message]:
        self.data, self.done = bytes(self._content), True
        return [mavlink.MAVLink_log_request_end_message(*self.target)]


def erase(target_system: int, target_component: int = 1) -> mavlink.MAVLink_message:
    """Removes all logs; nothing answers."""
    return mavlink.MAVLink_log_erase_message(target_system, target_component)
