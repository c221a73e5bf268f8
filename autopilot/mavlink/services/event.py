"""Events interface: EVENT, CURRENT_EVENT_SEQUENCE, REQUEST_EVENT (https://mavlink.io/en/services/events.html).

As PX4's mavlink_events.cpp: the newest events are kept for who lost some; the sequence number is announced every 3 s
on every link.
"""

from collections import deque
from typing import Any, NamedTuple

from autopilot.mavlink.context import Context
from autopilot.mavlink.link import Link
from autopilot.mavlink.services.service import is_for
from sitl_emu.core import dialect as mavlink

ANNOUNCE_US = 3_000_000
KEPT = 16
ERROR_UNAVAILABLE = 0


class StoredEvent(NamedTuple):
    """One EVENT as it was sent."""

    sequence: int
    id: int
    time_boot_ms: int
    log_levels: int
    arguments: bytes


class Event:
    """Keeps and sends events."""

    MESSAGES = frozenset({mavlink.MAVLINK_MSG_ID_REQUEST_EVENT})
    HAS_TIMER = True

    def __init__(self, context: Context, links: tuple[Link, ...], system_id: int) -> None:
        """Sends on all `links`."""
        self._context = context
        self._links = links
        self._system_id = system_id
        self._kept: deque[StoredEvent] = deque(maxlen=KEPT)
        self._announce_us = ANNOUNCE_US

    def emit(self, now_us: int, event_id: int, log_levels: int, arguments: bytes = b"") -> None:
        """Send an event to everybody."""
        self._context.events_sequence = sequence = (self._context.events_sequence + 1) & 0xFFFF
        event = StoredEvent(sequence, event_id, now_us // 1000, log_levels, arguments.ljust(40, b"\0"))
        self._kept.append(event)
        for link in self._links:
            self._send(link, event, 0, 0)

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """REQUEST_EVENT: send what is still known of the range, and an error for what is not."""
        if not is_for(message, self._system_id, broadcast=False):
            return
        partner = (message.get_srcSystem(), message.get_srcComponent())
        count = ((message.last_sequence - message.first_sequence) & 0xFFFF) + 1
        known = {event.sequence: event for event in self._kept}
        for offset in range(min(count, KEPT)):
            sequence = (message.first_sequence + offset) & 0xFFFF
            event = known.get(sequence)
            if event is not None:
                self._send(link, event, *partner)
                continue
            oldest = self._kept[0].sequence if self._kept else self._context.events_sequence
            fields = (sequence, oldest, *partner, ERROR_UNAVAILABLE)
            link.send_fields(mavlink.MAVLINK_MSG_ID_RESPONSE_EVENT_ERROR, *fields)
            return

    def on_time(self, now_us: int) -> None:
        """Announce the newest sequence number."""
        if now_us >= self._announce_us:
            self._announce_us += ANNOUNCE_US
            for link in self._links:
                link.send_fields(mavlink.MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE, self._context.events_sequence, 0)

    @staticmethod
    def _send(link: Link, event: StoredEvent, system: int, component: int) -> None:
        link.send_fields(
            mavlink.MAVLINK_MSG_ID_EVENT,
            event.id,
            event.time_boot_ms,
            event.sequence,
            component,
            system,
            event.log_levels,
            *event.arguments,
        )
