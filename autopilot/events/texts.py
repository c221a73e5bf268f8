"""What the autopilot tells people: STATUSTEXTs, waiting for the links, and the events that go with them."""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.events import Events

KEPT = 50


class Text(NamedTuple):
    """One text; `number` counts up, so that links know what they have sent; `module` is PX4's name of the speaker."""

    number: int
    severity: Severity
    text: str
    module: str


class Say(Protocol):
    """Tells the ground a text, and sends the event that says the same in numbers."""

    def __call__(self, severity: Severity, text: str, event: str = "", *arguments: float) -> None:
        """PX4's texts that have an event end in a tab; `event` is its name, `arguments` are the event's.

        An event that PX4 sends without a text has an empty one.
        """
        ...


SendEvent = Callable[..., None]
"""events.Events.send: name, level, arguments."""


class Texts:
    """The last texts. Any module may say something; each link sends what is new to it."""

    def __init__(self) -> None:
        self.recent: deque[Text] = deque(maxlen=KEPT)
        self.count = 0
        self.events = Events()

    def say(self, severity: Severity, text: str, event: str = "", *arguments: float, module: str = "commander") -> None:
        """Tell the ground; see Say."""
        if text:
            self.recent.append(Text(self.count, severity, text, module))
            self.count += 1
        if event:
            self.events.send(event, severity, *arguments)

    def of(self, module: str) -> Say:
        """`say` for one module."""

        def say(severity: Severity, text: str, event: str = "", *arguments: float) -> None:
            self.say(severity, text, event, *arguments, module=module)

        return say
