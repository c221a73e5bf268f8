"""What the autopilot tells people: STATUSTEXTs, waiting for the links, and the events that go with them."""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.events import Events

KEPT = 50
PRINTED = {Severity.CRITICAL: Severity.WARNING, Severity.EMERGENCY: Severity.ERROR}
"""What is told the ground is printed, too, and so gets into the log, at a level of the console: mavlink_log_critical
and mavlink_log_emergency (src/lib/systemlib/mavlink_log.h, v1.18)."""


class Text(NamedTuple):
    """One text; `number` counts up, so that links know what they have sent; `module` is PX4's name of the speaker."""

    number: int
    severity: Severity
    text: str
    module: str


class LogLine(NamedTuple):
    """One line of the log; `number` counts up."""

    number: int
    severity: Severity
    line: str


class Say(Protocol):
    """Tells the ground a text, and sends the event that says the same in numbers."""

    def __call__(self, severity: Severity, text: str, event: str = "", *arguments: float) -> None:
        """PX4's texts that have an event end in a tab; `event` is its name, `arguments` are the event's.

        An event that PX4 sends without a text has an empty one.
        """
        ...


SendEvent = Callable[..., None]
"""events.Events.send: name, level, arguments."""


Note = Callable[[Severity, str], None]
"""Texts.note: a line for the log alone."""


class Texts:
    """The last texts. Any module may say something; each link sends what is new to it."""

    def __init__(self) -> None:
        self.recent: deque[Text] = deque(maxlen=KEPT)
        self.count = 0
        self.lines: deque[LogLine] = deque(maxlen=KEPT)
        """What the log says in words: every text with its module, and what components of the vehicle say."""
        self.lines_count = 0
        self.events = Events()

    def say(self, severity: Severity, text: str, event: str = "", *arguments: float, module: str = "commander") -> None:
        """Tell the ground; see Say."""
        if text:
            self.recent.append(Text(self.count, severity, text, module))
            self.count += 1
            self.note(PRINTED.get(severity, severity), f"[{module}] {text}")
        if event:
            self.events.send(event, severity, *arguments)

    def note(self, severity: Severity, line: str) -> None:
        """Write a line into the log; nobody on the ground is told."""
        self.lines.append(LogLine(self.lines_count, severity, line))
        self.lines_count += 1

    def of(self, module: str) -> Say:
        """`say` for one module."""

        def say(severity: Severity, text: str, event: str = "", *arguments: float) -> None:
            self.say(severity, text, event, *arguments, module=module)

        return say
