"""STATUSTEXT: what the autopilot says, cut into chunks of 50 characters (PX4: streams/STATUSTEXT.hpp).

As PX4 does, it speaks only on links on which a ground station was heard (a HEARTBEAT of type GCS), and to nobody while
the connection to ground stations is lost; what is said meanwhile is never sent. PX4 falls silent on a link 2.5 s after
its last heartbeat; here it does once the connection counts as lost (COM_DL_LOSS_T), which leaves their texts to ground
stations that send a heartbeat once a second beside a simulation that is faster than that.
"""

from typing import Any

from autopilot.mavlink.link import Link
from autopilot.texts import Texts
from autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink

CHUNK = 50
STREAMED_MODES = frozenset({"normal", "onboard", "onboard_low_bandwidth"})


class StatusText:
    """Sends what is new in `texts` on every link that streams texts and has a ground station."""

    MESSAGES: frozenset[int] = frozenset()
    HAS_TIMER = True

    def __init__(self, links: tuple[Link, ...], topics: Topics, texts: Texts) -> None:
        """Texts said before are not sent."""
        self._topics = topics
        self._links = tuple(link for link in links if link.mode in STREAMED_MODES)
        self._texts = texts
        self._sent = texts.count
        self._chunk_id = 0

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Never called: nothing is listened to."""

    def on_time(self, now_us: int) -> None:
        """Send what is new."""
        if self._texts.count == self._sent:
            return
        if not self._topics.vehicle_status.gcs_connection_lost:
            for text in self._texts.recent:
                if text.number >= self._sent:
                    self._send(int(text.severity), text.text.encode())
        self._sent = self._texts.count

    def _send(self, severity: int, text: bytes) -> None:
        chunk_id = 0
        if len(text) > CHUNK:
            self._chunk_id = chunk_id = self._chunk_id % 0xFFFF + 1
        chunks = [text[start : start + CHUNK] for start in range(0, len(text), CHUNK)] or [b""]
        for link in self._links:
            if link.heard_gcs and link.statustext_interval_us > 0:
                for sequence, chunk in enumerate(chunks):
                    link.send_fields(mavlink.MAVLINK_MSG_ID_STATUSTEXT, severity, chunk, chunk_id, sequence)
