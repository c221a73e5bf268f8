"""What drives a companion: hands it messages, frames and time, sends what it returns, and writes down its events.

One harness for both worlds. Whoever holds it has the clock: on hardware `main.py`, which reads what has come; in a
simulated run its companion process, which reads exactly what it is told of. No clock is read and no socket opened here.
"""

from collections.abc import Iterable, Mapping

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions.companion.camera import Frame
from sitl_emu.missions.companion.companion import Companion, Event, HasCandidates, LooksAtTimes, Outgoing, SeesRanges
from sitl_emu.missions.companion.detection_log import DetectionLog
from sitl_emu.missions.companion.feeds import Ranges
from sitl_emu.missions.companion.inference import Inference, Looked
from sitl_emu.missions.companion.links import Link
from sitl_emu.missions.companion.pictures import Album

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
        self.send(now_us, companion.on_time(now_us))
        return [self._pictured(event) for event in companion.events()]

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

    def _write_down(self, looked: Looked) -> None:
        log, source = self._detections, self._has_candidates
        if log is not None:
            wanted = source is not None and log.wants_candidates(looked)
            log.add(looked, source.candidates() if source is not None and wanted else None)

    def _pictured(self, event: Event) -> Event:
        picture = self._album.written(event) if self._album is not None else None
        return event if picture is None else event._replace(data={**event.data, "picture": picture})
