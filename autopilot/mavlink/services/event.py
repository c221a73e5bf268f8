"""Events interface: EVENT, CURRENT_EVENT_SEQUENCE, REQUEST_EVENT (https://mavlink.io/en/services/events.html).

As PX4's mavlink_events.cpp: the last 20 events are kept for who lost some, and everybody gets them anew whoever asked.
The newest sequence number is announced every 3 s on every link, and with the flag RESET by the first events after the
start, of which a link sends the newest alone: the others are there for who asks.
"""

from collections import deque
from typing import Any, ClassVar, Final, NamedTuple

from sitl_emu.autopilot.events.events import Events
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink

ANNOUNCE_US: Final = 3_000_000
CAPACITY: Final = 20
FIRST_SEQUENCE: Final = 65526
"""PX4 begins shortly before the numbers wrap around, so that clients learn to expect it."""
ARGUMENT_BYTES: Final = 40
FLAG_RESET: Final = 1
"""MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET."""
ERROR_UNAVAILABLE: Final = 0
"""MAV_EVENT_ERROR_REASON_UNAVAILABLE."""
SEQUENCES = 1 << 16


class StoredEvent(NamedTuple):
    """One EVENT as it was sent."""

    sequence: int
    id: int
    time_boot_ms: int
    log_levels: int
    arguments: bytes


class Event:
    """Keeps and sends events."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_REQUEST_EVENT})
    HAS_TIMER = True

    def __init__(self, links: tuple[Link, ...], events: Events) -> None:
        """Sends on all `links` what is new in `events`."""
        self._events = events
        self._seen = 0
        self._links = links
        self._kept: deque[StoredEvent] = deque(maxlen=CAPACITY)
        self._sequence = (FIRST_SEQUENCE - 1) % SEQUENCES
        self._announce_us = ANNOUNCE_US

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """REQUEST_EVENT: send what is still known of the range, and an error for each that is not.

        Of a range that is longer than what is kept, the part before gets one error. One that ends just before it begins
        is empty (SendProtocol::handle_request_event). PX4 does not ask whom it is for.
        """
        first, count = message.first_sequence, (message.last_sequence + 1 - message.first_sequence) % SEQUENCES
        if count > CAPACITY:
            self._send_error(link, message, first)
            first, count = (message.last_sequence - CAPACITY + 1) % SEQUENCES, CAPACITY
        known = {event.sequence: event for event in self._kept}
        for offset in range(count):
            sequence = (first + offset) % SEQUENCES
            event = known.get(sequence)
            if event is not None:
                _send(link, event)
            else:
                self._send_error(link, message, sequence)

    def on_time(self, now_us: int) -> None:
        """Send new events, and announce the newest sequence number."""
        if self._events.count != self._seen:
            self._send_new(now_us)
        if now_us >= self._announce_us:
            self._announce(now_us, 0 if self._kept else FLAG_RESET)

    def _send_new(self, now_us: int) -> None:
        first_ever = not self._kept
        new = []
        for event in self._events.recent:
            if event.number >= self._seen:
                self._sequence = (self._sequence + 1) % SEQUENCES
                arguments = event.arguments.ljust(ARGUMENT_BYTES, b"\0")
                new.append(StoredEvent(self._sequence, event.id, now_us // 1000, event.log_levels, arguments))
        self._seen = self._events.count
        self._kept.extend(new)
        if first_ever:
            self._announce(now_us, FLAG_RESET)
            del new[:-1]
        for link in self._links:
            for stored in new:
                _send(link, stored)

    def _announce(self, now_us: int, flags: int) -> None:
        self._announce_us = now_us + ANNOUNCE_US
        for link in self._links:
            link.send_fields(mavlink.MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE, self._sequence, flags)

    def _send_error(self, link: Link, message: Any, sequence: int) -> None:
        later = [event.sequence for event in self._kept if event.sequence != sequence]
        oldest = min(later, key=lambda kept: (kept - sequence) % SEQUENCES, default=self._sequence)
        link.send_fields(
            mavlink.MAVLINK_MSG_ID_RESPONSE_EVENT_ERROR,
            sequence,
            oldest,
            message.get_srcSystem(),
            message.get_srcComponent(),
            ERROR_UNAVAILABLE,
        )


def _send(link: Link, event: StoredEvent) -> None:
    link.send_fields(
        mavlink.MAVLINK_MSG_ID_EVENT,
        event.id,
        event.time_boot_ms,
        event.sequence,
        0,
        0,
        event.log_levels,
        *event.arguments,
    )
