"""What the autopilot tells people: STATUSTEXTs, waiting for the links to send them."""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from autopilot.constants import Severity

KEPT = 50


class Text(NamedTuple):
    """One text; `number` counts up, so that links know what they have sent; `module` is PX4's name of the speaker."""

    number: int
    severity: Severity
    text: str
    module: str


class Texts:
    """The last texts. Any module may say something; each link sends what is new to it."""

    def __init__(self) -> None:
        self.recent: deque[Text] = deque(maxlen=KEPT)
        self.count = 0

    def say(self, severity: Severity, text: str, module: str = "commander") -> None:
        """Tell the ground; PX4's texts that have an event end in a tab, which is part of the text."""
        self.recent.append(Text(self.count, severity, text, module))
        self.count += 1

    def of(self, module: str) -> Callable[[Severity, str], None]:
        """`say` for one module."""
        return lambda severity, text: self.say(severity, text, module)
