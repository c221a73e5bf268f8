"""A scout's targets on their way to those who inspect them, and the reports on their way back.

Whoever says on the peer link that its role is to inspect is sent one target at a time, of those that wait the one that
is nearest to it, the next when it has reported. With several of them, each has a target of its own; when one is lost,
its target waits again for the others.

An inspector may have other scouts to serve: a target waits there until its turn, at most `queue_timeout_us`; when it
has said that it sets out, it has `report_timeout_us` to report, and again from when it has said that a pilot or a
failsafe has taken it over, or has given it back. It counts as lost when it was needed (a target is to be
sent, or a report awaited) and nothing was heard of it for the peer link's time limit.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sitl_emu.gcs.geodesy import distance_m
from sitl_emu.gcs.mission import MissionUpload
from sitl_emu.missions.agriculture.jobs import Wanted, items_of
from sitl_emu.missions.agriculture.report import INTERIM, Report, Result
from sitl_emu.missions.agriculture.roles import Role
from sitl_emu.missions.companion.companion import COMPONENT_ID, PEER_LINK
from sitl_emu.missions.companion.confirmation import Target
from sitl_emu.missions.companion.onboard import Onboard, Script, advanced

OPEN = ("queued", "sending", "waiting", "driving", *(result.name for result in INTERIM))


class DeliveryFailed(Exception):
    """An inspector does not do what it should; the text is what became of the target."""


class InspectorLost(Exception):
    """An inspector is needed and has been silent for too long."""


class PeerLost(Exception):
    """Nobody is left to inspect what was found."""


@dataclass
class Delivery:
    """One target on its way to an inspector and back."""

    target: Target
    state: str = "queued"
    """queued (here), sending, waiting (there), driving, then a Result's name, or what failed."""
    place: tuple[int, int] = (0, 0)
    """Where the inspector was told that the target is, 1e-7 deg."""
    report: Report | None = None
    """What the inspector last reported of it, but that it has started."""
    started_us: int | None = None
    """When the inspector said that it has started, or last that somebody has taken it over, or given it back."""

    @property
    def is_over(self) -> bool:
        """Whether it was said what became of the target."""
        return self.report is not None and self.report.result not in INTERIM

    @property
    def succeeded(self) -> bool:
        """Whether the target was seen, with its label."""
        return self.report is not None and self.report.result is Result.CONFIRMED


class Deliveries:
    """All targets of one scout."""

    def __init__(
        self,
        onboard: Onboard,
        place: Callable[[Target], tuple[float, float]],
        latest: Callable[[Target], Target],
        report_timeout_us: int,
        queue_timeout_us: int,
    ) -> None:
        """`place`: latitude and longitude of a target; `latest`: the same target at its latest estimate."""
        self.all: list[Delivery] = []
        self._onboard, self._place, self._latest = onboard, place, latest
        self._report_timeout_us, self._queue_timeout_us = report_timeout_us, queue_timeout_us
        self._serving: dict[int, tuple[Delivery, Script]] = {}
        """What each inspector is at, by its system."""
        self._nobody_since_us: int | None = None
        """Since when a target has waited while nobody was known who inspects."""

    @property
    def open(self) -> list[Delivery]:
        """Those not reported on, and not given up."""
        return [one for one in self.all if not one.is_over and one.state in OPEN]

    @property
    def idle(self) -> bool:
        """Whether there is nothing more to send, nor any report to wait for."""
        return not self._serving and not any(one.state == "queued" for one in self.all)

    @property
    def outcome(self) -> str:
        """ "success", or what became of the first target that was not inspected as it should."""
        bad = next((one for one in self.all if not one.succeeded), None)
        return "success" if bad is None else f"target {bad.target.id}: {bad.state.lower().replace('_', ' ')}"

    def on_time(self) -> None:
        """Goes on with all deliveries. Raises PeerLost."""
        inspectors = self._inspectors()
        for system in sorted({*inspectors, *self._serving}):
            if system in self._serving:
                self._go_on(system)
            while system not in self._serving and (wanted := self._next_for(system)) is not None:
                self._serving[system] = (wanted, self._serve(wanted, system))
                self._go_on(system)
        waits = not inspectors and any(one.state == "queued" for one in self.all)
        self._nobody_since_us = (self._nobody_since_us or self._onboard.now_us) if waits else None
        if self._nobody_since_us is not None and self._onboard.peer.lost(
            self._onboard.now_us, None, self._nobody_since_us
        ):
            raise PeerLost("peer link lost")

    def take_report(self, report: Report) -> bool:
        """A report has come; False if it is about nothing that was sent."""
        one = next((one for one in self.all if one.place == (report.x, report.y)), None)
        if one is None:
            return False
        if one.is_over and report.result in INTERIM:
            return True  # of before that, and late
        if report.result is Result.STARTED:
            if one.started_us is None or one.report is not None:  # and not the same once more
                one.state, one.started_us, one.report = "driving", self._onboard.now_us, None
            return True
        if report.result in INTERIM:
            one.started_us = self._onboard.now_us
        if one.report is None or one.report[:3] != report[:3]:  # what was not seen has no distance: it equals nothing
            one.report, one.state = report, report.result.name
            result = report.result.name.lower()
            text = f"{one.target.id}: {result.replace('_', ' ')}"
            self._onboard.say(f"Target {text}")
            self._onboard.note(
                "report_received",
                f"target {text}",
                target=one.target.id,
                result=result,
                score=report.score,
                label=report.label,
            )
        return True

    def _inspectors(self) -> list[int]:
        """The systems to send targets to, in order: of those that are heard, or of all if none is any more."""
        peers = self._onboard.peer.with_role(Role.INSPECT)
        known = [peer.system for peer in peers if peer.place is not None]
        return [system for system in known if not self._is_silent(system)] or known

    def _next_for(self, system: int) -> Delivery | None:
        """The waiting target that is nearest to an inspector."""
        waiting = [one for one in self.all if one.state == "queued"]
        peer = self._onboard.peer.peers.get(system)
        place = peer.place if peer is not None else None
        if place is None or not waiting:
            return None
        return min(waiting, key=lambda one: distance_m(place.lat_deg, place.lon_deg, *self._place(one.target)))

    def _go_on(self, system: int) -> None:
        """Steps what an inspector is at."""
        one, script = self._serving[system]
        try:
            if advanced(script) is None:
                del self._serving[system]
        except DeliveryFailed as failure:
            del self._serving[system]
            one.state = str(failure)
            self._onboard.note("failed", f"target {one.target.id}: {failure}", target=one.target.id)
        except InspectorLost:
            del self._serving[system]
            others = [other for other in self._inspectors() if other != system and not self._is_silent(other)]
            if not others:
                raise PeerLost("peer link lost") from None
            self._onboard.note("peer_lost", f"system {system}; its target {one.target.id} waits again", system=system)
            one.state, one.started_us, one.report = "queued", None, None
            self._onboard.peer.forget(system)

    def _serve(self, one: Delivery, system: int) -> Script:
        """One target's way to an inspector, until it has reported."""
        since_us = self._onboard.now_us
        wanted = self._wanted(one)
        one.state, one.place = "sending", (wanted.x, wanted.y)
        self._onboard.note(
            "target_sent",
            f"target {one.target.id} goes to system {system}",
            target=one.target.id,
            label=one.target.label,
            score=one.target.score,
            lat_deg=wanted.x * 1e-7,
            lon_deg=wanted.y * 1e-7,
            system=system,
        )
        upload = MissionUpload(system, items_of(wanted), target_component=COMPONENT_ID, tries=1000)
        self._onboard.start(PEER_LINK, upload)
        while upload.outcome is None:
            self._check(system, since_us)
            yield
        if not upload.outcome.accepted:
            raise DeliveryFailed(f"refused by the UGV: {upload.outcome.text}")
        if not one.is_over:
            one.state = "waiting"
        self._onboard.note("target_accepted", f"the UGV has target {one.target.id}", target=one.target.id)
        yield from self._until_reported(one, system)

    def _until_reported(self, one: Delivery, system: int) -> Script:
        """Until an inspector has reported on a target that it has: first its turn comes, then it drives."""
        since_us = now_us = self._onboard.now_us
        while not one.is_over:
            self._check(system, since_us)
            if one.started_us is None and now_us - since_us > self._queue_timeout_us:
                raise DeliveryFailed("the UGV did not start")
            if one.started_us is not None and now_us - one.started_us > self._report_timeout_us:
                raise DeliveryFailed("no report from the UGV" if one.report is None else one.state)
            yield
            now_us = self._onboard.now_us

    def _check(self, system: int, since_us: int) -> None:
        """Raises InspectorLost when an inspector, needed since `since_us`, has been silent for too long."""
        if self._onboard.peer.lost(self._onboard.now_us, system, since_us):
            raise InspectorLost

    def _is_silent(self, system: int) -> bool:
        return self._onboard.peer.lost(self._onboard.now_us, system, 0)

    def _wanted(self, one: Delivery) -> Wanted:
        """What an inspector is asked for: the target's latest estimate."""
        one.target = self._latest(one.target)
        lat_deg, lon_deg = self._place(one.target)
        return Wanted(round(lat_deg * 1e7), round(lon_deg * 1e7), one.target.label, one.target.score)
