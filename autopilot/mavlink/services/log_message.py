"""STATUSTEXT of the vehicle's own components: into the autopilot's log, where their words stand beside its own.

As PX4's MavlinkStatustextHandler (uORB log_message): chunks of a text are put together, on each link for itself; what
was lost of it is marked. Ground stations are told nothing of it: they hear the component itself, by forwarding.
"""

from typing import Any, ClassVar, Final

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink

CHUNK: Final = 50
LONGEST: Final = 126
"""log_message.text is so long."""
LONGEST_ALONE: Final = CHUNK - 1
"""A text without chunks loses its fiftieth character."""
MISSING: Final = "[ missing ... ]"


class LinkTexts:
    """The text that is being put together on a link."""

    def __init__(self) -> None:
        self.severity = Severity.INFO
        self.text = ""
        self.id = 0
        """0: none is under way."""
        self.chunk = -1

    def add(self, piece: str) -> None:
        """As much of it as there is room for."""
        self.text = (self.text + piece)[:LONGEST]


class LogMessage:
    """Notes what components say."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_STATUSTEXT})
    HAS_TIMER = False

    def __init__(self, texts: Texts, system_id: int) -> None:
        """Writes into `texts`, for the log alone."""
        self._texts = texts
        self._system_id = system_id
        self._links: dict[Link, LinkTexts] = {}

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """A whole text, or a chunk of one; a new one ends what was under way."""
        if message.get_srcSystem() != self._system_id:
            return
        heard = self._links.setdefault(link, LinkTexts())
        if heard.id and message.id != heard.id:
            heard.add(MISSING)
            self._texts.note(heard.severity, heard.text)
        severity = Severity(min(message.severity, Severity.DEBUG))
        if message.id == 0:
            heard.id = 0
            self._texts.note(severity, message.text[:LONGEST_ALONE])
            return
        if message.id != heard.id:
            heard.severity = severity
        if message.chunk_seq == 0:
            heard.text = message.text
        else:
            if message.chunk_seq != heard.chunk + 1:
                heard.add(MISSING)
            heard.add(message.text)
        is_whole = len(message.text) < CHUNK or len(heard.text) == LONGEST
        heard.id, heard.chunk = (0, -1) if is_whole else (message.id, message.chunk_seq)
        if is_whole:
            self._texts.note(heard.severity, heard.text)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
