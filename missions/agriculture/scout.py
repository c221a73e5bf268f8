"""The UAS's companion: scouts a field by a plan, finds targets, sends each to the UGV, hears what the UGV saw.

It uploads the plan's mission, fence and rally points as a ground station would, waits until the autopilot is ready,
arms and flies it. Frames taken over the field go through the detector; a target that `confirmation.py` reports is
sent to the UGV's companion over the peer link by the mission protocol (`jobs.py`), one target after the other, the next
when the UGV has reported. The scan goes on meanwhile. After the plan's end it waits, landed, for the last report.

The UGV may have other scouts to serve: a target waits there until its turn, at most `queue_timeout_s`; when the UGV has
said that it sets out, it has `report_timeout_s` to report.

**The mission is a success** when the whole field was seen, and the UGV has seen every target that was found there, with
the label that the scout gave it.

**The peer link** counts as lost when the UGV is needed (a target is to be sent, or a report awaited) and nothing was
heard of it for `peer_timeout_s` (20 s). Then the mission says so, the UAS returns home and the outcome is "peer link
lost".

**A pilot or a failsafe** that chooses another mode takes the UAS over: no more commands to it until the mode is MISSION
again. Targets go on being sent; the mission ends when the vehicle is disarmed, with which of the two it was as outcome.

Options: `plan` (a .plan file; needed), `peer_timeout_s`, `report_timeout_s`, `queue_timeout_s`, `ready_timeout_s`,
`return_altitude_m` (sets RTL_RETURN_ALT first; 0 leaves it), `scan_altitude_m` (frames from below are not looked at).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gcs.command import Command, arm
from gcs.geodesy import from_metres, to_metres
from gcs.mission import FENCE, MISSION, RALLY, MissionUpload
from gcs.parameter import ParameterSet
from gcs.plan_file import FlightPlan, PlanError, read_plan
from gcs.set_mode import set_mode
from gcs.statustext import CRITICAL, WARNING
from gcs.telemetry import Pose, Telemetry
from missions.agriculture.detector import ClassicalDetector
from missions.agriculture.jobs import Wanted, items_of
from missions.agriculture.report import Report, Result, ack_of, report_of
from missions.companion.camera import Image
from missions.companion.camera_model import NADIR, CameraModel, camera_pose, gsd_m
from missions.companion.companion import AUTOPILOT_LINK, COMPONENT_ID, PEER_LINK, Event, Outgoing, Status
from missions.companion.confirmation import Confirmation, Target
from missions.companion.detector import Detection, Detector
from missions.companion.onboard import Onboard, Script, advanced
from missions.companion.options import Options
from sitl_emu.core import dialect as mavlink

NAV_WAYPOINT, NAV_LAND, NAV_RETURN_TO_LAUNCH = 16, 21, 20
GROUND_ROVER = 10
ARM_TRIES = 20
ARM_PAUSE_US = 1_000_000
LANDING_TIMEOUT_US = 300_000_000
SCAN_TIMEOUT_US = 1_800_000_000
AREA_MARGIN_M = 1.0
UPLOADS = ((MISSION, "mission"), (FENCE, "fence"), (RALLY, "rally points"))


class MissionFailed(Exception):
    """Why the mission can't go on; the text is its outcome."""


class PeerLost(Exception):
    """The UGV is needed and has been silent for too long."""


@dataclass
class Job:
    """One target on its way to the UGV and back."""

    target: Target
    state: str = "queued"
    """queued (here), sending, waiting (there), driving, then a Result's name, or what failed."""
    place: tuple[int, int] = (0, 0)
    """Where the UGV was told that the target is, 1e-7 deg."""
    report: Report | None = None
    """What the UGV last reported of it, but that it has started."""
    started_us: int | None = None
    """When the UGV said that it has started."""

    @property
    def succeeded(self) -> bool:
        """Whether the UGV has seen the target, with its label."""
        return self.report is not None and self.report.result is Result.CONFIRMED


class Scout:
    """The UAS's companion. See the module for what it does."""

    def __init__(
        self,
        plan: FlightPlan,
        detector: Detector,
        *,
        peer_timeout_s: float = 20.0,
        report_timeout_s: float = 300.0,
        queue_timeout_s: float = 1800.0,
        ready_timeout_s: float = 120.0,
        return_altitude_m: float = 0.0,
        scan_altitude_m: float = 8.0,
        camera: CameraModel | None = None,
    ) -> None:
        self.plan, self.detector = plan, detector
        self.scan_altitude_m, self.return_altitude_m = scan_altitude_m, return_altitude_m
        self._report_timeout_us, self._ready_timeout_us = round(report_timeout_s * 1e6), round(ready_timeout_s * 1e6)
        self._queue_timeout_us = round(queue_timeout_s * 1e6)
        self._camera = camera or CameraModel()
        self._confirmation = Confirmation(self._camera, 0.0, inside=self._in_area)
        self._last_waypoint = max((i for i, item in enumerate(plan.mission) if item.command == NAV_WAYPOINT), default=0)
        self._ends_by_itself = bool(plan.mission) and plan.mission[-1].command in (NAV_RETURN_TO_LAUNCH, NAV_LAND)
        self._origin: tuple[float, float, float] | None = None
        """Home as latitude, longitude, altitude: origin of the metres that targets are placed in."""
        self.jobs: list[Job] = []
        self._onboard = Onboard(round(peer_timeout_s * 1e6))
        self._now_us = 0
        self._phase, self._text, self._outcome = "connecting", "waiting for the autopilot", ""
        self._done = False
        self._scanning = self._scanned = self._flown = False
        self._failure: str | None = None
        self._flight: Script | None = self._fly()
        self._delivery: Script | None = self._deliver()

    @classmethod
    def from_options(cls, given: Options) -> "Scout":
        """From a scenario's options. Raises ValueError for a wrong one, or a plan that can't be read."""
        path = given.text("plan")
        plan = read_plan(Path(path))
        scout = cls(
            plan,
            ClassicalDetector(),
            peer_timeout_s=given.number("peer_timeout_s", 20.0, 5.0, 600.0),
            report_timeout_s=given.number("report_timeout_s", 300.0, 10.0, 3600.0),
            queue_timeout_s=given.number("queue_timeout_s", 1800.0, 10.0, 36000.0),
            ready_timeout_s=given.number("ready_timeout_s", 120.0, 5.0, 3600.0),
            return_altitude_m=given.number("return_altitude_m", 0.0, 0.0, 150.0),
            scan_altitude_m=given.number("scan_altitude_m", 8.0, 0.0, 100.0),
        )
        if not plan.mission:
            raise PlanError(f"{path}: mission.items: empty; allowed: a mission with a Survey")
        return scout

    @property
    def system_id(self) -> int:
        """MAVLink system of the UAS."""
        return self._onboard.system_id

    @property
    def status(self) -> Status:
        """Where the mission stands."""
        phase = "yielded" if self._onboard.yielding.yielded_to is not None else self._phase
        return Status(phase, self._progress(), self._done, self._outcome, self._text)

    def events(self) -> list[Event]:
        """The events since the last call."""
        return self._onboard.events()

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """Routes, and hears the UGV's reports."""
        self._now_us = now_us
        mine, out = self._onboard.on_message(now_us, link, msg)
        if mine and link == PEER_LINK:
            report = report_of(msg)
            if report is not None:
                out.append((PEER_LINK, ack_of(msg, self._take_report(report))))
        return out

    def wants_frame(self, frame_time_us: int) -> float | None:
        """Frames taken high enough over the field, while it is scanned."""
        pose = self._pose(frame_time_us) if self._scanning else None
        if pose is None or pose.alt_home_m < self.scan_altitude_m or self._origin is None:
            return None
        return gsd_m(self._camera, camera_pose(self._position(pose), pose.q, NADIR), 0.0) or 0.0

    def detect(self, image: Image, gsd: float) -> list[Detection]:
        """Runs the detector."""
        return self.detector.detect(image, gsd or None)

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[Detection]) -> Outgoing:
        """Places and confirms what was detected."""
        self._now_us = now_us
        pose = self._pose(frame_time_us)
        if pose is not None and self._origin is not None:
            seen_from = camera_pose(self._position(pose), pose.q, NADIR)
            for target in self._confirmation.update(frame_time_us, seen_from, detections):
                self._add(target)
        return []

    def on_time(self, now_us: int) -> Outgoing:
        """Goes on with the flight (unless a pilot has the vehicle) and with what the UGV is sent."""
        self._now_us = now_us
        yielded = self._onboard.watch_pilot(now_us)
        if not yielded:
            try:
                self._flight = advanced(self._flight)
            except MissionFailed as failure:
                self._fail("failed", str(failure))
        elif self._phase not in ("connecting", "uploading", "waiting for health") and not self._telemetry.armed:
            self._end(self._failure or self._onboard.taken_by)
        try:
            self._delivery = advanced(self._delivery)
        except PeerLost as lost:
            self._fail("peer_lost", str(lost))
        if self._flight is None and self._delivery is None and not self._done:
            self._end(self._failure or self._verdict())
        return self._onboard.on_time(now_us)

    # What the pilot of a scouting flight would do, in order

    def _fly(self) -> Script:
        telemetry = self._telemetry
        while not telemetry.system:
            yield
        self._enter("uploading", f"plan with {len(self.plan.mission)} items")
        if self.return_altitude_m > 0.0:
            yield from self._onboard.do(
                AUTOPILOT_LINK, ParameterSet(telemetry.system, "RTL_RETURN_ALT", self.return_altitude_m)
            )
        for mission_type, name in UPLOADS:
            items = (self.plan.mission, self.plan.fence, self.plan.rally)[mission_type]
            upload = yield from self._onboard.do(AUTOPILOT_LINK, MissionUpload(telemetry.system, items, mission_type))
            if upload.outcome is None or not upload.outcome.accepted:
                text = upload.outcome.text if upload.outcome else "no answer"
                raise MissionFailed(f"upload of {name} failed: {text}")
        self._enter("waiting for health", "autopilot gets ready")
        yield from self._until_ready()
        self._enter("starting", "mission mode, arming")
        yield from self._command(set_mode(telemetry.system, "mission"), "mission mode")
        yield from self._arm()
        self._onboard.yielding.expect({"mission", "takeoff"})
        self._origin = telemetry.home
        self._scanning = True
        self._enter("scanning", "flying the survey")
        yield from self._until_scanned()
        self._scanned = True
        self._onboard.yielding.expect({"mission", "return", "land", "hold"})
        self._enter("returning", "the whole field has been seen")
        if not self._ends_by_itself:
            yield from self._command(set_mode(telemetry.system, "return"), "return")
        yield from self._until_landed()

    def _until_ready(self) -> Script:
        since_us = self._now_us
        while not self._telemetry.ready:
            if self._now_us - since_us > self._ready_timeout_us:
                raise MissionFailed(f"autopilot not ready after {self._ready_timeout_us / 1e6:.0f} s")
            yield

    def _arm(self) -> Script:
        for _ in range(ARM_TRIES):
            command = yield from self._onboard.do(AUTOPILOT_LINK, arm(self._telemetry.system))
            if command.outcome is not None and command.outcome.accepted:
                break
            since_us = self._now_us
            while self._now_us - since_us < ARM_PAUSE_US:
                yield
        else:
            raise MissionFailed(f"arming refused: {command.outcome.text if command.outcome else 'no answer'}")
        while not self._telemetry.armed:
            yield

    def _command(self, command: Command, what: str) -> Script:
        yield from self._onboard.do(AUTOPILOT_LINK, command)
        if command.outcome is None or not command.outcome.accepted:
            raise MissionFailed(f"{what}: {command.outcome.text if command.outcome else 'no answer'}")

    def _until_scanned(self) -> Script:
        telemetry, since_us = self._telemetry, self._now_us
        while (telemetry.mission_reached or 0) < self._last_waypoint:
            if not telemetry.armed:
                raise MissionFailed("disarmed before the survey was flown")
            if self._now_us - since_us > SCAN_TIMEOUT_US:
                raise MissionFailed("the survey did not end")
            yield

    def _until_landed(self) -> Script:
        since_us = self._now_us
        while self._telemetry.armed:
            if self._now_us - since_us > LANDING_TIMEOUT_US:
                raise MissionFailed("did not land and disarm")
            yield
        self._scanning = False
        for target in self._confirmation.finish():
            self._add(target)
        self._flown = True
        self._onboard.yielding.expect(())
        waiting = len(self._open_jobs())
        self._enter("landed", self._failure or (f"waiting for {waiting} reports" if waiting else "all reports are in"))

    def _return_home(self, why: str) -> Script:
        """After a failure in the air: home, down, off."""
        self._enter("failed", why)
        self._scanning = False
        if self._telemetry.armed:
            command = set_mode(self._telemetry.system, "return")
            yield from self._onboard.do(AUTOPILOT_LINK, command)
            self._onboard.yielding.expect({"return", "land", "hold"})
            yield from self._until_landed()
        self._flown = True

    # What the UGV is sent

    def _deliver(self) -> Script:
        while True:
            job = self._next_job()
            if job is None:
                if self._flown:
                    return
                yield
                continue
            try:
                yield from self._send(job)
            except MissionFailed as failure:
                job.state = str(failure)
                self._onboard.note(self._now_us, "failed", f"target {job.target.id}: {failure}", target=job.target.id)

    def _send(self, job: Job) -> Script:
        since_us = self._now_us
        while (ugv := self._ugv()) is None:
            self._check_peer(None, since_us)
            yield
        wanted = self._wanted(job)
        job.state, job.place = "sending", (wanted.x, wanted.y)
        self._onboard.note(
            self._now_us,
            "target_sent",
            f"target {job.target.id} goes to system {ugv}",
            target=job.target.id,
            label=job.target.label,
            score=job.target.score,
            lat_deg=wanted.x * 1e-7,
            lon_deg=wanted.y * 1e-7,
            system=ugv,
        )
        upload = MissionUpload(ugv, items_of(wanted), target_component=COMPONENT_ID, tries=1000)
        self._onboard.start(PEER_LINK, upload)
        while upload.outcome is None:
            self._check_peer(ugv, since_us)
            yield
        if not upload.outcome.accepted:
            raise MissionFailed(f"refused by the UGV: {upload.outcome.text}")
        if job.report is None:
            job.state = "waiting"
        self._onboard.note(self._now_us, "target_accepted", f"the UGV has target {job.target.id}", target=job.target.id)
        yield from self._until_reported(job, ugv)

    def _until_reported(self, job: Job, ugv: int) -> Script:
        """Until the UGV has reported on a target that it has: first its turn comes, then it drives."""
        since_us = self._now_us
        while job.report is None:
            self._check_peer(ugv, since_us)
            if job.started_us is None and self._now_us - since_us > self._queue_timeout_us:
                raise MissionFailed("the UGV did not start")
            if job.started_us is not None and self._now_us - job.started_us > self._report_timeout_us:
                raise MissionFailed("no report from the UGV")
            yield
        job.state = job.report.result.name

    def _check_peer(self, system: int | None, since_us: int) -> None:
        """Raises PeerLost when the UGV, needed since `since_us`, has been silent for too long."""
        if self._onboard.peer.lost(self._now_us, system, since_us):
            raise PeerLost("peer link lost")

    def _ugv(self) -> int | None:
        """The system to send targets to: the first ground rover that was heard with a companion."""
        for system, peer in sorted(self._onboard.peer.peers.items()):
            if peer.mav_type == GROUND_ROVER and peer.companion_heard and peer.place is not None:
                return system
        return None

    def _next_job(self) -> Job | None:
        """The queued target nearest to the UGV."""
        queued = [job for job in self.jobs if job.state == "queued"]
        ugv = self._ugv()
        place = self._onboard.peer.peers[ugv].place if ugv is not None else None
        if place is None or self._origin is None or not queued:
            return queued[0] if queued else None
        north, east = to_metres(place.lat_deg, place.lon_deg, *self._origin[:2])
        return min(queued, key=lambda job: math.hypot(job.target.north_m - north, job.target.east_m - east))

    def _wanted(self, job: Job) -> Wanted:
        """What the UGV is asked for: the target's latest estimate."""
        job.target = next((t for t in self._confirmation.targets if t.id == job.target.id), job.target)
        lat, lon = self._global(job.target)
        return Wanted(round(lat * 1e7), round(lon * 1e7), job.target.label, job.target.score)

    def _take_report(self, report: Report) -> bool:
        job = next((job for job in self.jobs if job.place == (report.x, report.y)), None)
        if job is None:
            return False
        if report.result is Result.STARTED:
            job.started_us = self._now_us if job.started_us is None else job.started_us
            job.state = "driving" if job.report is None else job.state
        elif job.report != report:
            job.report, job.state = report, report.result.name
            result = report.result.name.lower()
            self._onboard.say(self._now_us, f"Target {job.target.id}: {result.replace('_', ' ')}")
            self._onboard.note(
                self._now_us,
                "report_received",
                f"target {job.target.id}: {result.replace('_', ' ')}",
                target=job.target.id,
                result=result,
                score=report.score,
                label=report.label,
            )
        return True

    # Bookkeeping

    @property
    def _telemetry(self) -> Telemetry:
        return self._onboard.telemetry

    def _fail(self, kind: str, why: str) -> None:
        """The mission can't go on: says so, and brings the UAS home."""
        self._failure = self._failure or why
        self._onboard.say(self._now_us, f"Mission: {why}", CRITICAL)
        self._onboard.note(self._now_us, kind, why)
        self._delivery = None
        self._flight = None if self._flown or self._phase == "failed" else self._return_home(why)

    def _enter(self, phase: str, text: str) -> None:
        self._phase, self._text = phase, text
        self._onboard.note(self._now_us, "phase", f"{phase}: {text}", phase=phase)

    def _end(self, outcome: str) -> None:
        if not self._done:
            self._done, self._outcome, self._delivery, self._flight = True, outcome, None, None
            self._enter("done", outcome)
            self._onboard.say(self._now_us, f"Mission ended: {outcome}", WARNING if outcome != "success" else 6)

    def _verdict(self) -> str:
        bad = [job for job in self.jobs if not job.succeeded]
        if bad:
            return f"target {bad[0].target.id}: {bad[0].state.lower().replace('_', ' ')}"
        return "success"

    def _open_jobs(self) -> list[Job]:
        return [
            job for job in self.jobs if job.report is None and job.state in ("queued", "sending", "waiting", "driving")
        ]

    def _progress(self) -> float:
        if self._done:
            return 1.0
        reached = (self._telemetry.mission_reached or 0) if self._scanning else 0
        flown = 1.0 if self._scanned else min(1.0, reached / max(1, self._last_waypoint))
        reported = sum(job.report is not None for job in self.jobs) / max(1, len(self.jobs))
        return 0.7 * flown + 0.2 * reported + 0.1 * self._flown

    def _pose(self, frame_time_us: int) -> Pose | None:
        return self._telemetry.pose_at(frame_time_us)

    def _position(self, pose: Pose) -> tuple[float, float, float]:
        """Metres NED from home."""
        assert self._origin is not None
        north, east = to_metres(pose.lat_deg, pose.lon_deg, *self._origin[:2])
        return north, east, self._origin[2] - pose.alt_amsl_m

    def _global(self, target: Target) -> tuple[float, float]:
        assert self._origin is not None
        return from_metres(target.north_m, target.east_m, *self._origin[:2])

    def _in_area(self, north_m: float, east_m: float) -> bool:
        """Whether a place lies in the plan's survey polygon (or within a metre of it)."""
        if not self.plan.area or self._origin is None:
            return True
        corners = [to_metres(lat, lon, *self._origin[:2]) for lat, lon in self.plan.area]
        inside, near = False, False
        for (n1, e1), (n2, e2) in zip(corners, corners[1:] + corners[:1], strict=True):
            if (e1 > east_m) != (e2 > east_m) and north_m < (n2 - n1) * (east_m - e1) / (e2 - e1) + n1:
                inside = not inside
            length2 = (n2 - n1) ** 2 + (e2 - e1) ** 2
            t = ((north_m - n1) * (n2 - n1) + (east_m - e1) * (e2 - e1)) / length2 if length2 > 0.0 else 0.0
            t = min(1.0, max(0.0, t))
            near |= math.hypot(north_m - n1 - t * (n2 - n1), east_m - e1 - t * (e2 - e1)) < AREA_MARGIN_M
        return inside or near

    def _add(self, target: Target) -> None:
        self.jobs.append(Job(target))
        lat, lon = self._global(target)
        box = target.detection
        self._onboard.say(self._now_us, f"Target {target.id}: {target.label}, score {target.score:.2f}")
        self._onboard.note(
            self._now_us,
            "target_confirmed",
            f"target {target.id}: {target.label}",
            target=target.id,
            label=target.label,
            score=target.score,
            lat_deg=lat,
            lon_deg=lon,
            frame_time_us=target.frame_time_us,
            x=box.x,
            y=box.y,
            w=box.w,
            h=box.h,
        )
