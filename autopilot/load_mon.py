"""How busy the processor is (PX4: src/modules/load_mon), for SYS_STATUS.load, the log and `listener cpuload`.

The emulator's own load depends on the machine and would differ from run to run. What is told is PX4's: 9 % of a core
with the streams of two links, as measured on PX4 v1.18 SITL, less where fewer messages are sent, more where more are.
"""

from collections.abc import Sequence
from typing import Protocol

from autopilot.topics import CpuLoad, Topics

INTERVAL_US = 500_000
LOAD_WITHOUT_MESSAGES = 0.05
LOAD_PER_MESSAGE_A_SECOND = 0.04 / 812.0
RAM_USAGE = 0.25
"""Of the computer's memory, used by everybody."""


class Sender(Protocol):
    """What is asked of a link."""

    messages_sent: int


class LoadMon:
    """Writer of cpuload."""

    def __init__(self, topics: Topics, links: Sequence[Sender]) -> None:
        self._topics = topics
        self._links = links
        self._due_us = INTERVAL_US
        self._messages = 0

    def update(self, now_us: int) -> None:
        """Called as often as one likes; does something twice a second."""
        if now_us < self._due_us:
            return
        self._due_us = now_us + INTERVAL_US
        messages = sum(link.messages_sent for link in self._links)
        per_s = (messages - self._messages) * (1e6 / INTERVAL_US)
        self._messages = messages
        load = min(LOAD_WITHOUT_MESSAGES + LOAD_PER_MESSAGE_A_SECOND * per_s, 1.0)
        self._topics.cpuload = CpuLoad(now_us, load, RAM_USAGE)
