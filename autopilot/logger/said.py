"""What was said and is in no log yet: texts and events (PX4: the logger's subscriptions of log_message and event).

The logger reads them only while it logs. Between logs the last few wait in uORB's queues, so that a log begins with
them: with the event that tells who armed, for instance.
"""

from collections import deque
from typing import Final

from sitl_emu.autopilot.events.events import DISABLED, Event
from sitl_emu.autopilot.events.texts import LogLine, Texts
from sitl_emu.autopilot.logger import ulog

LINES_QUEUED: Final = 4
EVENTS_QUEUED: Final = 16
"""ORB_QUEUE_LENGTH of LogMessage.msg and Event.msg."""


class Said:
    """The two queues."""

    def __init__(self, texts: Texts) -> None:
        self._texts = texts
        self._lines: deque[tuple[int, LogLine]] = deque(maxlen=LINES_QUEUED)
        self._events: deque[tuple[int, Event]] = deque(maxlen=EVENTS_QUEUED)
        self._lines_seen = self._events_seen = self._left_out = 0

    def hear(self, now_us: int) -> None:
        """Take what is new; run often, whether it is logged now or not."""
        texts, events = self._texts, self._texts.events
        if texts.lines_count != self._lines_seen:
            self._lines += [(now_us, line) for line in texts.lines if line.number >= self._lines_seen]
            self._lines_seen = texts.lines_count
        if events.count != self._events_seen:
            self._events += [(now_us, event) for event in events.recent if event.number >= self._events_seen]
            self._events_seen = events.count

    def take_lines(self) -> list[bytes]:
        """The texts as messages of the log."""
        messages = [ulog.logged_message(line.severity, heard_us, line.line) for heard_us, line in self._lines]
        self._lines.clear()
        return messages

    def take_events(self) -> list[tuple[int, Event]]:
        """The events that are for the log, and when they were heard; numbered without those that are not."""
        taken = []
        for heard_us, event in self._events:
            if event.log_levels >> 4 == DISABLED:
                self._left_out += 1
            else:
                taken.append((heard_us, event._replace(number=event.number - self._left_out)))
        self._events.clear()
        return taken
