"""The log's MAVLink side: ULog messages cut into chunks of LOGGING_DATA (PX4: log_writer_mavlink.cpp).

What a reader can't do without (header, formats, parameters, subscriptions) goes in chunks that must be acknowledged,
one after the other; while one waits, PX4's logger waits with it, so nothing else is logged to the stream.
"""

from collections import deque
from typing import NamedTuple

CHUNK_BYTES = 249
"""LOGGING_DATA.data."""
NO_MESSAGE_BEGINS = 255
"""LOGGING_DATA.first_message_offset of a chunk in which no ULog message begins."""


class Chunk(NamedTuple):
    """One LOGGING_DATA or, if it must be acknowledged, LOGGING_DATA_ACKED."""

    sequence: int
    first_message_offset: int
    data: bytes
    reliable: bool


class LogStream:
    """Cuts ULog messages into chunks; whoever sends them takes them from `reliable`, one by one, and from `ready`."""

    def __init__(self, definitions: list[bytes]) -> None:
        """`definitions` are the messages with which a log begins."""
        self.reliable: deque[Chunk] = deque()
        """To be acknowledged; the first one is waited for."""
        self.ready: deque[Chunk] = deque()
        """To be sent once."""
        self._sequence = 0
        self._first = 0
        self._data = b""
        for message in definitions:
            self._append(message, self.reliable)
        if self._data:
            self._finish_chunk(self.reliable)

    @property
    def blocked(self) -> bool:
        """An acknowledgement is waited for."""
        return bool(self.reliable)

    def write(self, message: bytes) -> None:
        """One ULog message of the running log; lost while an acknowledgement is waited for."""
        if not self.reliable:
            self._append(message, self.ready)

    def acknowledge(self) -> None:
        """The first reliable chunk arrived."""
        self.reliable.popleft()

    def _append(self, message: bytes, chunks: deque[Chunk]) -> None:
        if self._first == NO_MESSAGE_BEGINS:
            self._first = len(self._data)
        data = self._data + message
        while len(data) >= CHUNK_BYTES:
            self._data, data = data[:CHUNK_BYTES], data[CHUNK_BYTES:]
            self._finish_chunk(chunks)
        self._data = data

    def _finish_chunk(self, chunks: deque[Chunk]) -> None:
        chunks.append(Chunk(self._sequence, self._first, self._data, chunks is self.reliable))
        self._sequence = (self._sequence + 1) & 0xFFFF
        self._first, self._data = NO_MESSAGE_BEGINS, b""
