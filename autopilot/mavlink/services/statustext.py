"""STATUSTEXT: what the autopilot says, cut into chunks of 50 characters (PX4: streams/STATUSTEXT.hpp).

It is a stream of 20 Hz that sends one text at a time: of many at once, a link loses all but the newest 8. Every text
of a link has an id of its own, with chunks or without. The first one's is 0, which says to others that there are no
chunks: so PX4 counts.

It speaks only on links that a ground station is on (a HEARTBEAT of type GCS, `Link.has_gcs`). What is said meanwhile
waits: who comes back is told of the last 5 s.

STATUSTEXT of the vehicle's own components goes into the autopilot's log, where their words stand beside its own (PX4:
MavlinkStatustextHandler, uORB log_message). Ground stations hear the component itself, by forwarding.
"""

from collections import deque
from typing import Any, ClassVar, Final

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Text, Texts
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink

CHUNK: Final = 50
QUEUE: Final = 8
"""Texts that wait for a link (uORB mavlink_log)."""
STALE_US: Final = 5_000_000
"""What is older is not sent any more."""
IDS: Final = 1 << 16
LONGEST: Final = 126
"""log_message.text is so long."""
LONGEST_ALONE: Final = CHUNK - 1
"""A text without chunks loses its fiftieth character."""
MISSING: Final = "[ missing ... ]"


class LinkTexts:
    """What a link has sent of the texts, and when it may send the next."""

    def __init__(self, link: Link, sent: int) -> None:
        self.link = link
        self.sent = sent
        self.due_us = 0
        self._text_id = 0

    def send(self, now_us: int, text: Text) -> None:
        """One text, in as many messages as it needs."""
        data = text.text.encode()
        for sequence in range((len(data) + CHUNK - 1) // CHUNK):
            chunk = data[sequence * CHUNK : (sequence + 1) * CHUNK]
            fields = (text.severity, chunk, self._text_id, sequence)
            self.link.send_fields(mavlink.MAVLINK_MSG_ID_STATUSTEXT, *fields)
        self._text_id = (self._text_id + 1) % IDS
        self.sent = text.number + 1
        self.due_us = now_us + self.link.statustext_interval_us


class StatusText:
    """Sends what is new in `texts` on every link that has a ground station."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset()
    HAS_TIMER = True

    def __init__(self, links: tuple[Link, ...], texts: Texts) -> None:
        """Texts said before are not sent."""
        self._texts = texts
        self._links = tuple(LinkTexts(link, texts.count) for link in links)
        self._settled = texts.count
        """Nothing that was said up to here is left to send."""
        self._seen = texts.count
        self._said_us = deque[int](maxlen=QUEUE)
        """When the last texts were said, up to number `_seen`."""

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Never called: nothing is listened to."""

    def on_time(self, now_us: int) -> None:
        """Send what is new and due."""
        count = self._texts.count
        if count == self._settled:
            return
        self._said_us.extend(now_us for _ in range(count - self._seen))
        self._seen = count
        fresh = count - sum(now_us - said_us < STALE_US for said_us in self._said_us)
        for each in self._links:
            if each.link.statustext_interval_us <= 0:
                each.sent = count
            each.sent = max(each.sent, fresh)
            if each.sent < count and now_us >= each.due_us and each.link.has_gcs(now_us):
                each.send(now_us, next(text for text in self._texts.recent if text.number >= each.sent))
        if all(each.sent == count for each in self._links):
            self._settled = count


class HeardText:
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


class ComponentTexts:
    """Puts together what components say, on each link for itself; what was lost of a text is marked."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_STATUSTEXT})
    HAS_TIMER = False

    def __init__(self, texts: Texts, system_id: int) -> None:
        """Writes into `texts`, for the log alone."""
        self._texts = texts
        self._system_id = system_id
        self._links: dict[Link, HeardText] = {}

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """A whole text, or a chunk of one; a new one ends what was under way."""
        if message.get_srcSystem() != self._system_id:
            return
        heard = self._links.setdefault(link, HeardText())
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
