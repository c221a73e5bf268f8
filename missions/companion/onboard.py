"""A companion's standing on its vehicle: telemetry, heartbeats, running services, yielding, texts and events.

What every mission needs, put together; a mission holds one `Onboard` and decides what to do.
"""

from collections.abc import Generator
from typing import TypeVar

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.failsafe import FailsafeWatch
from sitl_emu.gcs.heartbeat import Heartbeat
from sitl_emu.gcs.service import Service
from sitl_emu.gcs.statustext import INFO, WARNING, messages_of
from sitl_emu.gcs.telemetry import Telemetry
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK, PEER_LINK, Event, Outgoing
from sitl_emu.missions.companion.feeds import Cloud, Depth, Ranges
from sitl_emu.missions.companion.peer_link import LOST_AFTER_US, MAV_TYPE_ONBOARD_CONTROLLER, PeerLink
from sitl_emu.missions.companion.router import is_for_companion
from sitl_emu.missions.companion.yielding import Yielding

AnyService = TypeVar("AnyService", bound=Service)
TERMINATION = "termination"
"""As `gcs.modes` names it; who was terminated by a failsafe goes on to show another (`gcs/failsafe.py`)."""
Script = Generator[None, None, None]
"""What a mission does, one thing after the other; it is gone on with at each step until its next `yield`."""


def advanced(script: Script | None) -> Script | None:
    """The script after its next step; None when it has ended. What it raises goes through."""
    try:
        if script is not None:
            next(script)
    except StopIteration:
        return None
    return script


class Onboard:
    """Hears, answers for itself, runs the services that a mission starts; knows the time, and the mission's phase."""

    def __init__(self, peer_lost_after_us: int = LOST_AFTER_US, role: int = 0, *, is_open: bool = True) -> None:
        """`role`: what the peers are told that this companion is there for, a number that its mission knows.

        `is_open`: whether peers are told that, and where the vehicle is (`peer_link.py`), which anybody may hear. A
        mission that seals what it says to them (`swarm/`) wants neither.
        """
        self.now_us = 0
        """The runner's time, of the call that the mission is in. A mission sets it itself in `on_detections`."""
        self.phase, self.text = "connecting", "waiting for the autopilot"
        """Where the mission stands, in a word, and in a line for people."""
        self.telemetry = Telemetry()
        self.peer = PeerLink(peer_lost_after_us)
        self.yielding = Yielding()
        self.given_back = 0
        """How often who had taken the vehicle has given it back: it may be anywhere then, and hold there."""
        self.failsafe: FailsafeWatch | None = None
        """Whether a failsafe has the vehicle, and which; None until its autopilot was heard."""
        self.depth: Depth | None = None
        """The newest depth image, of a vehicle that has such a feed."""
        self.cloud: Cloud | None = None
        """The newest scan of a scanning lidar."""
        self._is_open = is_open
        self._heartbeats = {AUTOPILOT_LINK: Heartbeat(MAV_TYPE_ONBOARD_CONTROLLER)}
        if is_open:
            self._heartbeats[PEER_LINK] = Heartbeat(MAV_TYPE_ONBOARD_CONTROLLER, role)
        self._services: list[tuple[str, Service]] = []
        self._outbox: Outgoing = []
        self._events: list[Event] = []
        self._text_id = 0
        self._was_silent = False
        self._watched_us = self._lent_us = 0

    @property
    def system_id(self) -> int:
        """MAVLink system of the vehicle, 0 until its autopilot was heard."""
        return self.telemetry.system

    @property
    def own_us(self) -> int:
        """`now_us` without the time that others had the vehicle, which counts for none of a mission's limits."""
        return self.now_us - self._lent_us

    def start(self, link: str, service: Service) -> None:
        """Runs a service on a link until it is done."""
        self._services.append((link, service))

    def do(self, link: str, service: AnyService) -> Generator[None, None, AnyService]:
        """The same as a step of a script: ends when the service is done."""
        self.start(link, service)
        while not service.done:
            yield
        return service

    @property
    def silence(self) -> str:
        """That the autopilot is silent, and for how long; "" while it speaks (`gcs.heartbeat.Watch`)."""
        watch = self.telemetry.watch
        if watch.heard_us is None or not watch.lost(self.now_us):
            return ""
        return f"nothing heard of the autopilot for {(self.now_us - watch.heard_us) * 1e-6:.1f} s"

    @property
    def taken_by(self) -> str:
        """Who has taken the vehicle: "pilot took over" or "failsafe (its cause)"; "" while it is ours."""
        if self.yielding.yielded_to is None:
            return ""
        if self.yielding.to_failsafe and self.failsafe is not None:
            return f"failsafe ({self.failsafe.cause})"
        return "pilot took over"

    @property
    def shown_phase(self) -> str:
        """The phase for people: "yielded" while somebody else has the vehicle."""
        return "yielded" if self.yielding.yielded_to is not None else self.phase

    def enter(self, phase: str, text: str) -> None:
        """The mission has come to another phase."""
        self.phase, self.text = phase, text
        self.note("phase", f"{phase}: {text}", phase=phase)

    def watch_pilot(self, now_us: int) -> bool:
        """True while a pilot or a failsafe has the vehicle; says which, and when it is given back.

        Services to the autopilot rest meanwhile.
        """
        self.now_us = now_us
        if self.yielding.yielded_to is not None:
            self._lent_us += now_us - self._watched_us
        self._watched_us = now_us
        acts = self.failsafe is not None and self.failsafe.active
        flown = TERMINATION if self.failsafe is not None and self.failsafe.terminated else self.telemetry.mode
        if flown and self.yielding.on_mode(now_us, flown, acts):
            mode = self.yielding.yielded_to
            if mode is not None:
                by = "failsafe" if self.yielding.to_failsafe else "pilot"
                self.say(f"Companion yields: {self.taken_by}, mode {mode}", WARNING)
                self.note("yielded", f"{self.taken_by}, mode {mode}", mode=mode, by=by)
            else:
                self.given_back += 1
                self.say(f"Companion resumes in {self.telemetry.mode}")
                self.note("resumed", f"in {self.telemetry.mode}")
        return self.yielding.yielded_to is not None

    def say(self, text: str, severity: int = INFO) -> None:
        """Tells people at the ground station, to which PX4 forwards it, its log, and the run's events."""
        self._text_id = self._text_id % 65535 + 1
        self._outbox += [(AUTOPILOT_LINK, msg) for msg in messages_of(text, severity, self._text_id)]
        self.note("text", text)

    def note(self, kind: str, text: str, **data: float | int | str) -> None:
        """Adds an event."""
        self._events.append(Event(self.now_us, kind, text, data))

    def events(self) -> list[Event]:
        """The events since the last call."""
        events, self._events = self._events, []
        return events

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> tuple[bool, Outgoing]:
        """Takes a message. Returns whether the mission should look at it, and what to send."""
        self.now_us = now_us
        if link == PEER_LINK:
            self.peer.heard(now_us, msg)
        system = self.telemetry.system
        out: Outgoing = []
        if link == AUTOPILOT_LINK and msg.get_srcComponent() == 1 and system in (0, msg.get_srcSystem()):
            self.telemetry.on_message(now_us, msg)
            system = self.telemetry.system
            if self.failsafe is None and system:
                self.failsafe = FailsafeWatch(system)
            if self.failsafe is not None:
                out += [(AUTOPILOT_LINK, asked) for asked in self.failsafe.on_message(now_us, msg)]
        elif link == AUTOPILOT_LINK and system == msg.get_srcSystem():
            self.telemetry.on_message(now_us, msg)
        if system == 0 or not is_for_companion(msg, system):
            return False, out
        if self._is_open and link == AUTOPILOT_LINK and msg.get_srcSystem() == system and msg.get_srcComponent() == 1:
            out += self.peer.share(now_us, msg)
        for service_link, service in self._services:
            if service_link == link:
                out += [(link, answer) for answer in service.on_message(now_us, msg)]
        return True, out

    def on_ranges(self, ranges: Ranges) -> None:
        """Takes a depth image or a scan."""
        if isinstance(ranges, Depth):
            self.depth = ranges
        else:
            self.cloud = ranges

    def on_time(self, now_us: int) -> Outgoing:
        """Heartbeats, what the services have to send, and the texts."""
        self.now_us = now_us
        if self.telemetry.system == 0:
            return []
        self._watch_autopilot()
        out, self._outbox = self._outbox, []
        for link, heartbeat in self._heartbeats.items():
            out += [(link, msg) for msg in heartbeat.on_time(now_us)]
        for link, service in self._services:
            if link != AUTOPILOT_LINK or self.yielding.yielded_to is None:
                out += [(link, msg) for msg in service.on_time(now_us)]
        self._services = [entry for entry in self._services if not entry[1].done]
        return out

    def _watch_autopilot(self) -> None:
        """Says once that it has fallen silent, and once that it is back: what stands still is then told from who is."""
        silence = self.silence
        if bool(silence) == self._was_silent:
            return
        self._was_silent = bool(silence)
        text = silence or "the autopilot is heard again"
        self.say(f"Companion: {text}", WARNING if silence else INFO)
        self.note("autopilot_silent" if silence else "autopilot_heard", text)
