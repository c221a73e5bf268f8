"""Events interface: EVENT, CURRENT_EVENT_SEQUENCE, REQUEST_EVENT (https://mavlink.io/en/services/events.html).

As PX4's mavlink_events.cpp: the newest events are kept for who lost some; the sequence number is announced every 3 s
on every link. Events come from the texts that have one (event_texts.py); arming checks are not reported as events.
"""

from collections import deque
from typing import Any, NamedTuple

from autopilot.mavlink.context import Context
from autopilot.mavlink.link import Link
from autopilot.mavlink.services.event_texts import event_of
from autopilot.mavlink.services.service import is_for
from autopilot.texts import Texts
from sitl_emu.core import dialect as mavlink

ANNOUNCE_US = 3_000_000
KEPT = 16
ERROR_UNAVAILABLE = 0
LOG_LEVEL = 0x11
"""Times the severity: the level for the log in the low half, the level for people in the high one."""


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

    def __init__(self, context: Context, links: tuple[Link, ...], texts: Texts, system_id: int) -> None:
        """Sends on all `links` the events of new `texts`."""
        self._texts = texts
        self._said = texts.count
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
        """Send the events of new texts, and announce the newest sequence number."""
        if self._texts.count != self._said:
            for text in self._texts.recent:
                event = event_of(text.text) if text.number >= self._said else None
                if event is not None:
                    self.emit(now_us, event.id, LOG_LEVEL * text.severity, event.arguments)
            self._said = self._texts.count
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
