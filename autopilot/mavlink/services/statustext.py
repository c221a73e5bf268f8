"""STATUSTEXT: what the autopilot says, cut into chunks of 50 characters (PX4: streams/STATUSTEXT.hpp).

It is a stream of 20 Hz that sends one text at a time: of many at once, a link loses all but the newest 8. Every text
of a link has an id of its own, with chunks or without; never 0, which would say that there are no chunks.

As PX4 does, it speaks only on links on which a ground station was heard (a HEARTBEAT of type GCS), and to nobody while
the connection to ground stations is lost; what is said meanwhile is never sent. PX4 falls silent on a link 2.5 s after
its last heartbeat; here it does once the connection counts as lost (COM_DL_LOSS_T), which leaves their texts to ground
stations that send a heartbeat once a second beside a simulation that is faster than that.
"""

from typing import Any, ClassVar, Final

from sitl_emu.autopilot.events.texts import Text, Texts
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink

CHUNK: Final = 50
STREAMED_MODES = frozenset({"normal", "onboard", "onboard_low_bandwidth"})
QUEUE: Final = 8
"""Texts that wait for a link (uORB mavlink_log)."""
LAST_ID = (1 << 16) - 1


class LinkTexts:
    """What a link has sent of the texts, and when it may send the next."""

    def __init__(self, link: Link, sent: int) -> None:
        self.link = link
        self.sent = sent
        self.due_us = 0
        self._text_id = 1

    def send(self, now_us: int, text: Text) -> None:
        """One text, in as many messages as it needs."""
        data = text.text.encode()
        for sequence in range((len(data) + CHUNK - 1) // CHUNK):
            chunk = data[sequence * CHUNK : (sequence + 1) * CHUNK]
            fields = (text.severity, chunk, self._text_id, sequence)
            self.link.send_fields(mavlink.MAVLINK_MSG_ID_STATUSTEXT, *fields)
        self._text_id = self._text_id % LAST_ID + 1
        self.sent = text.number + 1
        self.due_us = now_us + self.link.statustext_interval_us


class StatusText:
    """Sends what is new in `texts` on every link that streams texts and has a ground station."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset()
    HAS_TIMER = True

    def __init__(self, links: tuple[Link, ...], topics: Topics, texts: Texts) -> None:
        """Texts said before are not sent."""
        self._topics = topics
        self._texts = texts
        self._links = tuple(LinkTexts(link, texts.count) for link in links if link.mode in STREAMED_MODES)
        self._settled = texts.count
        """Everybody has sent what was said up to here."""

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Never called: nothing is listened to."""

    def on_time(self, now_us: int) -> None:
        """Send what is new and due."""
        count = self._texts.count
        if count == self._settled:
            return
        lost = self._topics.vehicle_status.gcs_connection_lost
        for each in self._links:
            if lost or not each.link.heard_gcs or each.link.statustext_interval_us <= 0:
                each.sent = count
            elif each.sent < count and now_us >= each.due_us:
                wanted = max(each.sent, count - QUEUE)
                each.send(now_us, next(text for text in self._texts.recent if text.number >= wanted))
        if all(each.sent == count for each in self._links):
            self._settled = count
