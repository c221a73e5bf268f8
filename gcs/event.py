"""Events interface, the ground station's half: every event of a component, in order, asking for those that were lost.

Source: https://mavlink.io/en/services/events.html and the rules of its reference client (libevents): the first event
heard begins the count; a gap, or a CURRENT_EVENT_SEQUENCE ahead of the last event, is asked for; an event that the
component no longer has is skipped; the flag RESET begins anew. What an event means is in the component's metadata.
"""

from typing import NamedTuple

from sitl_emu.core import dialect as mavlink

SEQUENCES = 1 << 16
FLAG_RESET = 1
RETRY_US = 100_000
RETRIES = 20
AHEAD = 1 << 15
"""Sequence numbers less than half the circle ahead are newer, the others older."""
KEPT = 256


class Event(NamedTuple):
    """One event; `arguments` are 40 bytes, as its metadata lays them out."""

    sequence: int
    id: int
    time_boot_ms: int
    log_levels: int
    arguments: bytes

    @property
    def level(self) -> int:
        """How important it is to people: MAV_SEVERITY, or 8 for what is not shown."""
        return self.log_levels & 0xF


class EventReceiver:
    """Collects the events of one component; hand it every message and the time."""

    def __init__(self, system: int, component: int = 1) -> None:
        """Listens to `system`/`component` alone."""
        self.missed = 0
        """Events that were lost for good."""
        self._source = (system, component)
        self._ready: list[Event] = []
        self._early: dict[int, Event] = {}
        self._last: int | None = None
        """Sequence number of the last event that was handed on."""
        self._newest = 0
        self._asked_us = 0
        self._asked = 0

    def take(self) -> list[Event]:
        """Events that came since the last call, none twice, none out of order."""
        taken, self._ready = self._ready, []
        return taken

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Takes EVENT, CURRENT_EVENT_SEQUENCE and RESPONSE_EVENT_ERROR; returns a request if something is missing."""
        if (msg.get_srcSystem(), msg.get_srcComponent()) != self._source:
            return []
        name = msg.get_type()
        if name == "EVENT":
            self._on_event(msg)
        elif name == "CURRENT_EVENT_SEQUENCE":
            self._on_current(msg)
        elif name == "RESPONSE_EVENT_ERROR":
            self._on_error(msg)
        else:
            return []
        return self.on_time(now_us)

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks for what is missing, again after a while; gives up after RETRIES."""
        gap = self._gap()
        if gap is None:
            self._asked = 0
            return []
        if self._asked and now_us - self._asked_us < RETRY_US:
            return []
        if self._asked >= RETRIES:
            self._skip_to((gap[1] + 1) % SEQUENCES)
            return self.on_time(now_us)
        self._asked += 1
        self._asked_us = now_us
        return [mavlink.MAVLink_request_event_message(*gap, *self._source)]

    def _on_event(self, msg: mavlink.MAVLink_message) -> None:
        event = Event(msg.sequence, msg.id, msg.event_time_boot_ms, msg.log_levels, bytes(msg.arguments))
        if self._last is None:
            self._last = self._newest = (event.sequence - 1) % SEQUENCES
        if _ahead(event.sequence, self._last) and len(self._early) < KEPT:
            self._early[event.sequence] = event
            if _ahead(event.sequence, self._newest):
                self._newest = event.sequence
        self._hand_on()

    def _on_current(self, msg: mavlink.MAVLink_message) -> None:
        if self._last is None or (msg.flags & FLAG_RESET and not _ahead(msg.sequence, self._last)):
            self._last = self._newest = msg.sequence
            self._early.clear()
        elif _ahead(msg.sequence, self._newest):
            self._newest = msg.sequence

    def _on_error(self, msg: mavlink.MAVLink_message) -> None:
        if self._last is not None and msg.sequence == (self._last + 1) % SEQUENCES:
            ahead = _ahead(msg.sequence_oldest_available, msg.sequence)
            self._skip_to(msg.sequence_oldest_available if ahead else (msg.sequence + 1) % SEQUENCES)

    def _skip_to(self, sequence: int) -> None:
        assert self._last is not None
        self.missed += (sequence - self._last - 1) % SEQUENCES
        self._last = (sequence - 1) % SEQUENCES
        self._early = {early: event for early, event in self._early.items() if _ahead(early, self._last)}
        if _ahead(self._last, self._newest):
            self._newest = self._last
        self._hand_on()

    def _hand_on(self) -> None:
        assert self._last is not None
        while (event := self._early.pop((self._last + 1) % SEQUENCES, None)) is not None:
            self._ready.append(event)
            self._last = event.sequence
            self._asked = 0

    def _gap(self) -> tuple[int, int] | None:
        """First and last of what is missing; what came between them comes once more, for what is missing comes soon."""
        if self._last is None or self._last == self._newest:
            return None
        last = self._newest
        while last in self._early:
            last = (last - 1) % SEQUENCES
        return (self._last + 1) % SEQUENCES, last


def _ahead(sequence: int, of: int) -> bool:
    return 0 < (sequence - of) % SEQUENCES < AHEAD
