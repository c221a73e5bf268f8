"""The UAS's companion: scouts a field by a plan, finds targets, sends each to the UGV, hears what the UGV saw.

It uploads the plan's mission, fence and rally points as a ground station would, waits until the autopilot is ready,
arms and flies it. Frames taken over the field go through the detector; a target that `confirmation.py` reports is
sent to the UGV's companion over the peer link by the mission protocol (`deliveries.py`). The scan goes on meanwhile.
After the plan's end it waits, landed, for the last report.

**The mission is a success** when the whole field was seen, and the UGV has seen every target that was found there, with
the label that the scout gave it. Without pictures for 20 s the field is not seen, and the UAS returns home.

**The peer link** counts as lost when the UGV is needed (a target is to be sent, or a report awaited) and nothing was
heard of it for `peer_timeout_s` (20 s). Then the mission says so, the UAS returns home and the outcome is "peer link
lost".

**A pilot or a failsafe** that chooses another mode takes the UAS over: no more commands to it until the mode is MISSION
again. Targets go on being sent; the mission ends when the vehicle is disarmed, with which of the two it was as outcome.
Who has it armed before the companion has is left it altogether: the mission ends before it has begun.

Options: `plan` (a .plan file; needed), `peer_timeout_s`, `report_timeout_s`, `queue_timeout_s`, `ready_timeout_s`,
`return_altitude_m` (sets RTL_RETURN_ALT first; 0 leaves it), `scan_altitude_m` (frames from below are not looked at),
`calibration` (the camera's file, `companion/calibration.py`), and those of `companion/perception.py`: detector,
selection, rate, confirmations, gates.
"""

import math
from collections.abc import Sequence
from pathlib import Path

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.geodesy import to_metres
from sitl_emu.gcs.mission import FENCE, MISSION, RALLY
from sitl_emu.gcs.plan_file import FlightPlan, PlanError, read_plan
from sitl_emu.gcs.set_mode import set_mode
from sitl_emu.gcs.statustext import CRITICAL, INFO, WARNING
from sitl_emu.missions.agriculture.deliveries import Deliveries, Delivery, PeerLost
from sitl_emu.missions.agriculture.detectors import FROM_THE_AIR
from sitl_emu.missions.agriculture.report import ack_of, report_of
from sitl_emu.missions.agriculture.roles import Role
from sitl_emu.missions.companion import calibration, steps
from sitl_emu.missions.companion.area import contains
from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, Mount
from sitl_emu.missions.companion.companion import PEER_LINK, Candidate, Event, Outgoing, Status
from sitl_emu.missions.companion.confirmation import Confirmation, Target
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.onboard import Onboard, Script, advanced
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.perception import Perception, perception_of
from sitl_emu.missions.companion.spotter import Origin, Spotter

NAV_WAYPOINT, NAV_LAND, NAV_RETURN_TO_LAUNCH = 16, 21, 20
SCAN_TIMEOUT_US = 1_800_000_000
AREA_MARGIN_M = 1.0
BLIND_S, BLIND_LOOKS = 20.0, 3.0
"""Who had no picture for so long and so many looks, high enough over the field, does not see it. Ours."""
BEFORE_FLIGHT = ("connecting", "uploading", "waiting for health")


class Scout:
    """The UAS's companion. See the module for what it does."""

    def __init__(
        self,
        plan: FlightPlan,
        perception: Perception,
        *,
        peer_timeout_s: float = 20.0,
        report_timeout_s: float = 900.0,
        queue_timeout_s: float = 1800.0,
        ready_timeout_s: float = 120.0,
        return_altitude_m: float = 0.0,
        scan_altitude_m: float = 8.0,
        camera: CameraModel | None = None,
        mount: Mount = NADIR,
    ) -> None:
        self.plan, self.perception = plan, perception
        self.scan_altitude_m, self.return_altitude_m = scan_altitude_m, return_altitude_m
        self._ready_timeout_s = ready_timeout_s
        self._camera, self._mount = camera or CameraModel(), mount
        self._last_waypoint = max((i for i, item in enumerate(plan.mission) if item.command == NAV_WAYPOINT), default=0)
        self._ends_by_itself = bool(plan.mission) and plan.mission[-1].command in (NAV_RETURN_TO_LAUNCH, NAV_LAND)
        self._onboard = Onboard(round(peer_timeout_s * 1e6), Role.SCOUT)
        self._spotter: Spotter | None = None
        """There from arming on, when home is known: the origin of the metres that targets are placed in."""
        self._deliveries = Deliveries(
            self._onboard, self._place, self._latest, round(report_timeout_s * 1e6), round(queue_timeout_s * 1e6)
        )
        self._outcome = ""
        self._done = False
        self._begun = self._scanning = self._scanned = self._flown = self._delivering_ended = False
        self._failure: str | None = None
        self._misfit = ""
        self._looked_us = 0
        """`Onboard.own_us` of the last picture that was looked at."""
        self._blind_us = round(1e6 * max(BLIND_S, BLIND_LOOKS / (perception.look_rate_hz or math.inf)))
        self._flight: Script | None = self._fly()

    @classmethod
    def from_options(cls, given: Options) -> "Scout":
        """From a scenario's options. Raises ValueError for a wrong one, or a plan that can't be read."""
        path = given.text("plan")
        plan = read_plan(Path(path))
        camera, mount = calibration.of(given, NADIR)
        if not any(item.command == NAV_WAYPOINT for item in plan.mission):
            raise PlanError(f"{path}: mission.items: no waypoint; allowed: a mission with a Survey")
        return cls(
            plan,
            perception_of(given, FROM_THE_AIR),
            peer_timeout_s=given.number("peer_timeout_s", 20.0, 5.0, 600.0),
            report_timeout_s=given.number("report_timeout_s", 900.0, 10.0, 3600.0),
            queue_timeout_s=given.number("queue_timeout_s", 1800.0, 10.0, 36000.0),
            ready_timeout_s=given.number("ready_timeout_s", 120.0, 5.0, 3600.0),
            return_altitude_m=given.number("return_altitude_m", 0.0, 0.0, 150.0),
            scan_altitude_m=given.number("scan_altitude_m", 8.0, 0.0, 100.0),
            camera=camera,
            mount=mount,
        )

    @property
    def system_id(self) -> int:
        """MAVLink system of the UAS."""
        return self._onboard.system_id

    @property
    def jobs(self) -> list[Delivery]:
        """The targets found, and what became of each."""
        return self._deliveries.all

    @property
    def status(self) -> Status:
        """Where the mission stands."""
        return Status(
            self._onboard.shown_phase, self._progress(), self._done, self._outcome, self._onboard.text, self._counts()
        )

    def events(self) -> list[Event]:
        """The events since the last call."""
        return self._onboard.events()

    def candidates(self) -> list[Candidate]:
        """What is seen and not reported yet."""
        return self._spotter.candidates() if self._spotter is not None else []

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """Routes, and hears the UGV's reports."""
        mine, out = self._onboard.on_message(now_us, link, msg)
        if mine and link == PEER_LINK:
            report = report_of(msg)
            if report is not None:
                out.append((PEER_LINK, ack_of(msg, self._deliveries.take_report(report))))
        return out

    @property
    def looks(self) -> bool:
        """From arming until it has landed."""
        return self._scanning

    def wants_frame(self, frame_time_us: int) -> float | None:
        """Frames taken high enough over the field, while it is scanned."""
        pose = self._onboard.telemetry.pose_at(frame_time_us)
        if not self._scanning or self._spotter is None or pose is None or pose.alt_home_m < self.scan_altitude_m:
            return None
        return self._spotter.wants(frame_time_us)

    def detect(self, image: Image, gsd_m: float) -> list[Detection]:
        """Runs the detector. A picture of a size that is not the camera's: nothing, and the mission fails."""
        misfit = self._camera.misfit(*image.shape[:2])
        if misfit:
            self._misfit = misfit
            return []
        return self.perception.detector.detect(image, gsd_m or None)

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[Detection]) -> Outgoing:
        """Places and confirms what was detected."""
        self._onboard.now_us = now_us
        if self._misfit:
            self.fail(self._misfit)
            return []
        self._looked_us = self._onboard.own_us
        for target in self._spotter.found(frame_time_us, detections) if self._spotter is not None else ():
            self._add(target)
        return []

    def on_time(self, now_us: int) -> Outgoing:
        """Goes on with the flight (unless a pilot has the vehicle) and with what the UGV is sent."""
        if not self._onboard.watch_pilot(now_us):
            try:
                self._flight = advanced(self._flight)
            except steps.StepFailed as failure:
                self._fail("failed", str(failure))
        elif self._onboard.phase not in BEFORE_FLIGHT and not self._onboard.telemetry.armed:
            self._end(self._failure or self._onboard.taken_by)
        self._deliver()
        if self._flight is None and self._delivering_ended and not self._done:
            self._end(self._failure or self._deliveries.outcome)
        return self._onboard.on_time(now_us)

    # What the pilot of a scouting flight would do, in order

    def _fly(self) -> Script:
        onboard = self._onboard
        yield from steps.heard(onboard)
        self._check_disarmed()
        yield from steps.select(onboard, self.perception)
        onboard.enter("uploading", f"plan with {len(self.plan.mission)} items")
        if self.return_altitude_m > 0.0:
            yield from steps.parameter(onboard, "RTL_RETURN_ALT", self.return_altitude_m)
        for mission_type, items in ((MISSION, self.plan.mission), (FENCE, self.plan.fence), (RALLY, self.plan.rally)):
            yield from steps.upload(onboard, items, mission_type)
        onboard.enter("waiting for health", "autopilot gets ready")
        yield from steps.ready(onboard, self._ready_timeout_s)
        self._check_disarmed()
        self._begun = True
        onboard.enter("starting", "mission mode, arming")
        yield from steps.command(onboard, set_mode(onboard.system_id, "mission"), "mission mode")
        onboard.telemetry.mission_reached = None  # of a flight before, which PX4 tells ten times (mavlink_mission.cpp)
        yield from steps.arm(onboard)
        onboard.yielding.expect({"mission", "takeoff"})
        while (home := onboard.telemetry.home) is None:  # it was known, but not to an autopilot that has started again
            yield
        self._begin_to_look(home)
        onboard.enter("scanning", "flying the survey")
        yield from self._until_scanned()
        self._scanned = True
        onboard.yielding.expect({"mission"} | steps.GOING_HOME)
        onboard.enter("returning", "the whole field has been seen")
        if not self._ends_by_itself:
            yield from steps.command(onboard, set_mode(onboard.system_id, "return"), "return")
        yield from steps.until_landed(onboard)
        self._end_the_flight()

    def _check_disarmed(self) -> None:
        """Raises StepFailed where somebody has the vehicle armed, as one who was started again in the air did."""
        if self._onboard.telemetry.armed:
            raise steps.StepFailed("the vehicle is armed already; land and disarm it first")

    def _until_scanned(self) -> Script:
        """Raises StepFailed where it is not flown to its end, or not seen."""
        telemetry = self._onboard.telemetry
        since_us = low_us = self._onboard.own_us
        while (telemetry.mission_reached or 0) < self._last_waypoint:
            if not telemetry.armed:
                raise steps.StepFailed("disarmed before the survey was flown")
            if self._onboard.own_us - since_us > SCAN_TIMEOUT_US:
                raise steps.StepFailed("the survey did not end")
            if telemetry.place is None or telemetry.place.alt_home_m < self.scan_altitude_m:
                low_us = self._onboard.own_us
            if self._onboard.own_us - max(low_us, self._looked_us) > self._blind_us:
                raise steps.StepFailed(f"no picture for {self._blind_us * 1e-6:.0f} s; look after the camera")
            yield
        if not self._looked_us:
            raise steps.StepFailed(f"no picture from {self.scan_altitude_m:g} m above home, scan_altitude_m, or higher")

    def _return_home(self, why: str) -> Script:
        """After a failure in the air: home, down, off."""
        self._onboard.enter("failed", why)
        self._scanning = False
        if self._begun and self._onboard.telemetry.armed:
            yield from steps.return_home(self._onboard)
            self._end_the_flight()
        self._flown = True

    def _begin_to_look(self, home: tuple[float, float, float]) -> None:
        _, confirming, look_rate_hz, _ = self.perception
        confirmation = Confirmation(self._camera, 0.0, confirming, inside=self._in_area)
        telemetry = self._onboard.telemetry
        self._spotter = Spotter(telemetry, self._camera, self._mount, Origin(*home), confirmation, look_rate_hz)
        self._scanning = True

    def _end_the_flight(self) -> None:
        self._scanning = False
        for target in self._spotter.confirmation.finish() if self._spotter is not None else ():
            self._add(target)
        self._flown = True
        self._onboard.yielding.expect(())
        waiting = len(self._deliveries.open)
        reports = f"waiting for {waiting} reports" if waiting else "all reports are in"
        self._onboard.enter("landed", self._failure or reports)

    def _deliver(self) -> None:
        """Goes on with what the UGV is sent, until nothing is left of a flight that has ended."""
        if self._delivering_ended:
            return
        try:
            self._deliveries.on_time()
        except PeerLost as lost:
            self._fail("peer_lost", str(lost))
        self._delivering_ended |= self._flown and self._deliveries.idle

    # Bookkeeping

    def fail(self, why: str) -> None:
        """It can't see any more."""
        if self._scanning and not self._failure:
            self._fail("failed", why)

    def _fail(self, kind: str, why: str) -> None:
        """The mission can't go on: says so, and brings the UAS home."""
        self._failure = self._failure or why
        self._onboard.say(f"Mission: {why}", CRITICAL)
        self._onboard.note(kind, why)
        self._delivering_ended = True
        self._flight = None if self._flown or self._onboard.phase == "failed" else self._return_home(why)

    def _end(self, outcome: str) -> None:
        if not self._done:
            self._done, self._outcome, self._delivering_ended, self._flight = True, outcome, True, None
            self._onboard.enter("done", outcome)
            self._onboard.say(f"Mission ended: {outcome}", WARNING if outcome != "success" else INFO)

    def _progress(self) -> float:
        if self._done:
            return 1.0
        reached = (self._onboard.telemetry.mission_reached or 0) if self._scanning else 0
        flown = 1.0 if self._scanned else min(1.0, reached / max(1, self._last_waypoint))
        reported = sum(job.is_over for job in self.jobs) / max(1, len(self.jobs))
        return 0.7 * flown + 0.2 * reported + 0.1 * self._flown

    def _counts(self) -> dict[str, int]:
        """Tracks that died unreported, and why."""
        died = self._spotter.confirmation.unreported if self._spotter is not None else {}
        return {f"tracks unreported: {why}": count for why, count in died.items()}

    def _place(self, target: Target) -> tuple[float, float]:
        assert self._spotter is not None  # there is no target without it
        return self._spotter.place(target)

    def _latest(self, target: Target) -> Target:
        known = self._spotter.confirmation.targets if self._spotter is not None else []
        return next((one for one in known if one.id == target.id), target)

    def _in_area(self, north_m: float, east_m: float) -> bool:
        """Whether a place lies in the plan's survey polygon (or within a metre of it)."""
        if not self.plan.area or self._spotter is None:
            return True
        origin = self._spotter.origin
        corners = [to_metres(lat, lon, origin.lat_deg, origin.lon_deg) for lat, lon in self.plan.area]
        return contains(corners, north_m, east_m, AREA_MARGIN_M)

    def _add(self, target: Target) -> None:
        self.jobs.append(Delivery(target))
        lat, lon = self._place(target)
        box = target.detection
        self._onboard.say(f"Target {target.id}: {target.label}, score {target.score:.2f}")
        self._onboard.note(
            "target_confirmed",
            f"target {target.id}: {target.label}",
            target=target.id,
            label=target.label,
            score=target.score,
            lat_deg=lat,
            lon_deg=lon,
            sigma_m=round(target.covariance_m2.horizontal_sigma_m, 3),
            residual_m=round(target.residual_m, 3),
            frame_time_us=target.frame_time_us,
            x=box.x,
            y=box.y,
            w=box.w,
            h=box.h,
        )
