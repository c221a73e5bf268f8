"""What drives a companion: hands it messages, frames and time, sends what it returns, and writes down its events.

One harness for both worlds. Whoever holds it has the clock: on hardware `main.py`, which reads what has come; in a
simulated run its companion process, which reads exactly what it is told of. No clock is read and no socket opened here.

What fails on the companion's computer, a log, a port, the detector, is said once, to the ground station as well, and
ends no flight; but who has a detector that fails at each frame is told to go home.
"""

from collections.abc import Iterable, Mapping

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.statustext import WARNING, messages_of
from sitl_emu.missions.companion.camera import Frame
from sitl_emu.missions.companion.companion import (
    AUTOPILOT_LINK,
    Companion,
    Event,
    Fails,
    HasCandidates,
    LooksAtTimes,
    Outgoing,
    SeesRanges,
)
from sitl_emu.missions.companion.detection_log import DetectionLog
from sitl_emu.missions.companion.feeds import Ranges
from sitl_emu.missions.companion.inference import Inference, Looked
from sitl_emu.missions.companion.links import Link
from sitl_emu.missions.companion.pictures import Album

LAST_TEXT = 65535
"""Ids of long texts count down from here; those of the companion's own count up (`onboard.py`)."""
Received = tuple[str, mavlink.MAVLink_message]
"""The name of a link, and a message that came in on it."""


class Harness:
    """A companion with its links, its detector and its pictures."""

    def __init__(
        self,
        companion: Companion,
        links: Mapping[str, Link],
        inference: Inference,
        album: Album | None = None,
        detections: DetectionLog | None = None,
    ) -> None:
        """`links` by name; messages for a link that is not there go nowhere. `album`: where pictures of events go.

        `detections`: where those of all frames go; closed with the rest.
        """
        self.companion, self.links, self.inference, self._album = companion, links, inference, album
        self._detections = detections
        self._has_candidates = companion if isinstance(companion, HasCandidates) else None
        self._sees_ranges = companion if isinstance(companion, SeesRanges) else None
        self._looks_at_times = companion if isinstance(companion, LooksAtTimes) else None
        self._fails = companion if isinstance(companion, Fails) else None
        self._said, self._events = list[str](), list[Event]()

    @property
    def looks(self) -> bool:
        """Whether the companion takes frames now: a camera that nobody looks at need make none."""
        return self._looks_at_times is None or self._looks_at_times.looks

    def step(
        self, now_us: int, received: Iterable[Received], frames: Iterable[Frame] = (), ranges: Iterable[Ranges] = ()
    ) -> list[Event]:
        """Messages, ranges, frames (both stamped with the vehicle's boot time), what the detector has found, time; the
        events.

        An event that names a frame which is kept names its picture, too (`picture`: FOLDER/FILE).
        """
        companion = self.companion
        for name, message in received:
            self.send(now_us, companion.on_message(now_us, name, message))
        if self._sees_ranges is not None:
            for one in ranges:
                self.send(now_us, self._sees_ranges.on_ranges(now_us, one))
        for frame in frames:
            gsd_m = companion.wants_frame(frame.time_usec)
            if gsd_m is not None:
                self.inference.look(now_us, frame, gsd_m)
        for looked in self.inference.due(now_us):
            self.send(now_us, companion.on_detections(now_us, looked.frame.time_usec, looked.detections))
            if self._album is not None:
                self._album.keep(looked)
            self._write_down(looked)
        self._watch(now_us)
        self.send(now_us, companion.on_time(now_us))
        events, self._events = self._events, []
        return events + [self._pictured(event) for event in companion.events()]

    def say(self, now_us: int, text: str) -> None:
        """Tells what has failed on this computer, as a warning at the ground station and an event; each text once."""
        if text in self._said:
            return
        self._said.append(text)
        self.send(now_us, [(AUTOPILOT_LINK, msg) for msg in messages_of(text, WARNING, LAST_TEXT - len(self._said))])
        self._events.append(Event(now_us, "text", text, {}))

    def send(self, now_us: int, outgoing: Outgoing) -> None:
        """Sends messages, each on its link."""
        for name, message in outgoing:
            if name in self.links:
                self.links[name].send(now_us, self.companion.system_id, message)

    def close(self) -> None:
        """Ends the detector's thread, makes logs whole, lets links go."""
        self.inference.close()
        for link in self.links.values():
            link.close()
        if self._detections is not None:
            self._detections.close()

    def _watch(self, now_us: int) -> None:
        """Says what has failed; ends the mission of who can't see any more."""
        for name, link in self.links.items():
            for error in link.errors:
                self.say(now_us, f"{name} link: {error}")
        log, inference = self._detections, self.inference
        for error in (log.error if log is not None else "", inference.error):
            if error:
                self.say(now_us, error)
        if inference.has_failed and self._fails is not None:
            self._fails.fail(inference.error)
            self._fails = None

    def _write_down(self, looked: Looked) -> None:
        log, source = self._detections, self._has_candidates
        if log is not None:
            wanted = source is not None and log.wants_candidates(looked)
            log.add(looked, source.candidates() if source is not None and wanted else None)

    def _pictured(self, event: Event) -> Event:
        picture = self._album.written(event) if self._album is not None else None
        return event if picture is None else event._replace(data={**event.data, "picture": picture})
