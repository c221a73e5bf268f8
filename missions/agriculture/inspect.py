"""The UGV's companion: takes targets from its peers, drives to one after the other, looks, reports back.

Scouts upload what they want inspected to this companion, as missions (`companion/mission_server.py`); `jobs.py` keeps
the queue and says which of them are the same target. For each job the companion gives its own autopilot a mission
that ends at the approach point, and starts it: mode MISSION, arm. A peer never changes what the autopilot drives.

**The way** there is straight over open ground; with a field's map (`field_map.py`), by its headland and along its rows
(`row_route.py`). Either ends at the approach point, `approach_m` (0.6 m) short of the target (`ways.py`). The vehicle
has arrived when it stands still within `arrival_m` of that point.

**The inspection**: a detection within `match_m` of where the target should be, confirmed over 3 consecutive frames and
of the label that the scout gave, ends it. If that does not happen in `look_s`, the vehicle turns, to look from the
other side, twice at most: among rows it drives out at the lane's end and comes back from the other; on open ground, as
an Ackermann rover can't turn on the spot, it drives `turn_m` on past the target, by DO_REPOSITION, and comes back to
face it. Something of another label that was seen there all the while is WRONG_LABEL, nothing is NOT_SEEN.
The report (`report.py`) goes to every scout that asked, until it is acknowledged; the vehicle meanwhile goes on with
the next job, or holds and is disarmed. With a field's map it drives home, where it stood before its first job, when no
job has come for `home_after_s`, and turns round for one that comes on the way.

A pilot or a failsafe that chooses another mode takes the vehicle over; who asked is told which, and the inspection goes
on when the mode is given back, which they are told as a start. While somebody drives it, armed in a mode other than
Hold, no job is begun, nor the way home.

Options: `approach_m`, `arrival_m`, `match_m`, `same_m` (nearer targets are the same), `look_s`, `turn_m`,
`drive_timeout_s` (and a second more for each metre of the way), `field_map`, `home_after_s`, `calibration` (the
camera's file, `companion/calibration.py`), and those of `companion/perception.py`: detector, selection, rate,
confirmations, gates. `match_m` and `same_m` grow with the error that the GNSS receiver states of itself, as the gates
do (`companion/confirmation.py`).
"""

import math
from collections.abc import Generator, Sequence

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.geodesy import distance_m, from_metres
from sitl_emu.gcs.mission import MissionItem
from sitl_emu.gcs.statustext import CRITICAL, WARNING
from sitl_emu.gcs.telemetry import Telemetry
from sitl_emu.missions.agriculture import driving, ways
from sitl_emu.missions.agriculture import field_map as field_maps
from sitl_emu.missions.agriculture.detectors import FROM_THE_MAST
from sitl_emu.missions.agriculture.field_map import FieldMap
from sitl_emu.missions.agriculture.jobs import SAME_M, Asker, Job, JobQueue, Sight, wanted_of
from sitl_emu.missions.agriculture.report import Result
from sitl_emu.missions.agriculture.reports import Reports
from sitl_emu.missions.agriculture.roles import Role
from sitl_emu.missions.agriculture.row_route import NoWay
from sitl_emu.missions.agriculture.ways import Course, LatLon, Way
from sitl_emu.missions.companion import calibration, steps
from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.camera_model import MAST, CameraModel, Mount
from sitl_emu.missions.companion.companion import PEER_LINK, Event, Outgoing, Status
from sitl_emu.missions.companion.confirmation import Confirmation, Target, widened_m
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.mission_server import ACCEPTED, UNSUPPORTED, MissionServer
from sitl_emu.missions.companion.onboard import Onboard, Script, advanced
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.perception import Perception, perception_of
from sitl_emu.missions.companion.spotter import Origin, Spotter

GROUND_DOWN_M = 2.0 + MAST.down_m
"""The ground below the vehicle's centre: the mast's 2 m less what the mount has."""
TURNS = 2
LEAST_SPEED_M_S = 1.0
"""On average, of a drive that is not given up: ours; the rover drives at 2.5 m/s, and slower through corners."""


class Inspect:
    """The UGV's companion. See the module for what it does."""

    def __init__(
        self,
        perception: Perception,
        *,
        approach_m: float = 0.6,
        arrival_m: float = 2.0,
        match_m: float = 2.5,
        same_m: float = SAME_M,
        look_s: float = 3.0,
        turn_m: float = 8.0,
        drive_timeout_s: float = 240.0,
        field_map: FieldMap | None = None,
        home_after_s: float = 10.0,
        camera: CameraModel | None = None,
        mount: Mount = MAST,
    ) -> None:
        self.perception = perception
        self.approach_m, self.arrival_m, self.match_m, self.turn_m = approach_m, arrival_m, match_m, turn_m
        self.same_m = same_m
        self._look_us, self._drive_timeout_s = round(look_s * 1e6), drive_timeout_s
        self._field_map, self._home_after_us = field_map, round(home_after_s * 1e6)
        self._home: LatLon | None = None
        """Where it stood before its first job; None until then."""
        self._is_away, self._astray = False, ""
        """Whether it is to drive home when there is nothing else to do; and why it could not."""
        self._camera, self._mount = camera or CameraModel(), mount
        self._onboard = Onboard(role=Role.INSPECT)
        self._missions = MissionServer(self._asked)
        self._queue = JobQueue()
        self._reports = Reports(self._onboard)
        self._spotter: Spotter | None = None
        """There while it looks for a target; its metres are those from where the target should be."""
        self._told_taken, self._misfit = False, ""
        self._has_looked = False
        """Whether a picture was looked at since it began to look."""
        self._script: Script | None = self._run()

    @classmethod
    def from_options(cls, given: Options) -> "Inspect":
        """From a scenario's options. Raises ValueError for a wrong one."""
        camera, mount = calibration.of(given, MAST)
        return cls(
            perception_of(given, FROM_THE_MAST),
            approach_m=given.number("approach_m", 0.6, 0.0, 5.0),
            arrival_m=given.number("arrival_m", 2.0, 0.2, 20.0),
            match_m=given.number("match_m", 2.5, 0.2, 10.0),
            same_m=given.number("same_m", SAME_M, 0.0, 50.0),
            look_s=given.number("look_s", 3.0, 0.5, 60.0),
            turn_m=given.number("turn_m", 8.0, 3.0, 50.0),
            drive_timeout_s=given.number("drive_timeout_s", 240.0, 10.0, 3600.0),
            field_map=field_maps.of(given),
            home_after_s=given.number("home_after_s", 10.0, 0.0, 3600.0),
            camera=camera,
            mount=mount,
        )

    @property
    def system_id(self) -> int:
        """MAVLink system of the UGV."""
        return self._onboard.system_id

    @property
    def status(self) -> Status:
        """Idle is done: there is nothing left to do until a peer sends the next target."""
        queue = self._queue
        resting = self._onboard.phase in ("connecting", "waiting") and not queue.waiting and not self._is_away
        idle = resting and not self._missions.busy and self._reports.idle
        outcome = self._outcome() if idle else ""
        return Status(self._onboard.shown_phase, float(idle), idle, outcome, self._onboard.text)

    def events(self) -> list[Event]:
        """The events since the last call."""
        return self._onboard.events()

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """Hears the autopilot, and what the peers ask for."""
        mine, out = self._onboard.on_message(now_us, link, msg)
        if mine and link == PEER_LINK:
            out += [(PEER_LINK, answer) for answer in self._missions.on_message(now_us, msg)]
        return out

    @property
    def looks(self) -> bool:
        """While it stands at a target."""
        return self._spotter is not None

    def wants_frame(self, frame_time_us: int) -> float | None:
        """Frames while it looks for the target."""
        return self._spotter.wants(frame_time_us) if self._spotter is not None else None

    def detect(self, image: Image, gsd: float) -> list[Detection]:
        """Runs the detector. A picture of a size that is not the camera's: nothing, and no target can be looked at."""
        misfit = self._camera.misfit(*image.shape[:2])
        if misfit:
            self._misfit = misfit
            return []
        return self.perception.detector.detect(image, gsd or None)

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[Detection]) -> Outgoing:
        """Confirms the expected target."""
        self._onboard.now_us = now_us
        job, spotter = self._queue.current, self._spotter
        seen_from = spotter.vehicle_at(frame_time_us) if spotter is not None else None
        if job is None or spotter is None or seen_from is None:
            return []
        self._has_looked = True
        for target in spotter.found(frame_time_us, detections):
            near = math.hypot(target.north_m, target.east_m) <= widened_m(self.match_m, self._telemetry.eph_m)
            if near and target.label not in {sight.label for sight in job.sights}:
                self._see(job, target, math.hypot(target.north_m - seen_from[0], target.east_m - seen_from[1]))
        return []

    def on_time(self, now_us: int) -> Outgoing:
        """Goes on with the job at hand, unless a pilot or a failsafe has the vehicle."""
        if not self._onboard.watch_pilot(now_us):
            if self._told_taken and self._queue.current is not None:
                self._reports.tell(self._queue.current, Result.STARTED)
            self._told_taken = False
            self._script = advanced(self._script)
        elif self._queue.current is not None and not self._told_taken:
            self._told_taken = True
            failsafe = self._onboard.yielding.to_failsafe
            self._reports.tell(self._queue.current, Result.FAILSAFE if failsafe else Result.PILOT_TOOK_OVER)
        self._reports.on_time()
        out: Outgoing = [(PEER_LINK, msg) for msg in self._missions.on_time(now_us)] if self.system_id else []
        return out + self._onboard.on_time(now_us)

    # What the scouts ask for, and are told

    def _asked(self, system: int, items: Sequence[MissionItem]) -> int:
        """A peer has uploaded a mission; a MAV_MISSION_RESULT."""
        wanted = wanted_of(items)
        if wanted is None:
            return UNSUPPORTED
        known = len(self._queue.jobs)
        job = self._queue.ask(system, wanted, widened_m(self.same_m, self._telemetry.eph_m))
        how = "new" if len(self._queue.jobs) > known else "known" if job.result is not None else "same"
        text = f"job {job.number}, {how}: {wanted.label or 'a target'} for system {system}"
        self._onboard.note("target_accepted", text, job=job.number, system=system, label=wanted.label)
        asker = Asker(system, wanted.x, wanted.y)
        if job.result is not None:
            self._reports.tell_one(asker, job, job.result)
        elif job is self._queue.current:
            self._reports.tell_one(asker, job, Result.STARTED)
        return ACCEPTED

    def _outcome(self) -> str:
        """Success if every job was, the target seen with its label, and the way home."""
        bad = next((job for job in self._queue.jobs if job.result is not Result.CONFIRMED), None)
        if bad is None or bad.result is None:
            return self._astray or "success"
        return f"job {bad.number}: {bad.result.name.lower().replace('_', ' ')}"

    # One job after the other

    def _run(self) -> Script:
        yield from steps.heard(self._onboard)
        try:
            yield from steps.select(self._onboard, self.perception)
        except steps.StepFailed as failure:
            self._astray = str(failure)
            self._onboard.say(f"Can't look: {failure}", CRITICAL)
            self._onboard.note("failed", self._astray)
            return
        while True:
            self._onboard.enter("waiting", "for a target")
            yield from self._until_asked()
            job = self._queue.begin()
            assert job is not None
            self._reports.tell(job, Result.STARTED)
            try:
                yield from self._visit(job)
                result = job.found
            except (steps.StepFailed, NoWay) as failure:
                self._onboard.say(f"Target not inspected: {failure}", WARNING)
                self._onboard.note("failed", f"job {job.number}: {failure}", job=job.number)
                result = Result.NOT_REACHED
            self._spotter = None
            self._queue.finish(result)
            self._reports.tell(job, result)
            self._onboard.enter("reporting", f"job {job.number}: {result.name.lower().replace('_', ' ')}")
            yield from driving.park(self._onboard)

    def _until_asked(self) -> Script:
        """Until there is a job; home meanwhile, where none comes for a while."""
        since_us = self._onboard.now_us
        told = False
        while not self._queue.waiting or self._is_driven:
            if self._queue.waiting and not told:
                told = True
                self._onboard.say("Somebody drives the vehicle: the target waits", WARNING)
            if self._is_away and not self._is_driven and self._onboard.now_us - since_us >= self._home_after_us:
                yield from self._go_home()
            else:
                yield

    def _visit(self, job: Job) -> Script:
        here = yield from driving.here(self._onboard)
        if self._home is None:
            self._home = here
        way = self._way(here, job)
        self._is_away, self._astray = self._field_map is not None, ""
        yield from self._approach(way, here, job)
        yield from self._look(job)
        for _ in range(TURNS):
            if job.found is Result.CONFIRMED:
                break
            way = yield from self._turn(job, way)
            yield from self._look(job)

    def _way(self, here: LatLon, job: Job, course: Course | None = None) -> Way:
        """To a job's target; `course`: on which to come there, where there are rows."""
        target = (job.lat_deg, job.lon_deg)
        if self._field_map is None:
            return ways.straight(here, driving.heading(self._onboard), target, self.approach_m)
        return ways.by_rows(self._field_map, here, driving.heading(self._onboard), target, self.approach_m, course)

    def _approach(self, way: Way, here: LatLon, job: Job) -> Script:
        """Drives to a job's target, and stands there."""
        length_m = way.length_m(here)
        self._onboard.enter("starting", f"job {job.number}: mission, arming")
        yield from driving.set_out(self._onboard, way)
        lat, lon = way.points[-1]
        text = f"job {job.number}: driving {length_m:.0f} m"
        self._onboard.note("target_started", text, job=job.number, lat_deg=lat, lon_deg=lon)
        self._onboard.enter("driving", f"job {job.number}: {length_m:.0f} m to the target")
        yield from self._until_there(way, length_m)
        stopped = yield from driving.here(self._onboard)
        self._onboard.note(
            "stopped",
            f"{distance_m(*stopped, lat, lon):.2f} m from the waypoint",
            job=job.number,
            lat_deg=stopped[0],
            lon_deg=stopped[1],
            waypoint_lat_deg=lat,
            waypoint_lon_deg=lon,
        )

    def _until_there(self, way: Way, length_m: float) -> Script:
        timeout_s = self._drive_timeout_s + length_m / LEAST_SPEED_M_S
        return driving.arrive(self._onboard, way, self.arrival_m, timeout_s)

    def _go_home(self) -> Script:
        """By headland and rows, and parks; or until there is a job, which the vehicle stops for."""
        assert self._home is not None and self._field_map is not None
        try:
            here = yield from driving.here(self._onboard)
            way = ways.home(self._field_map, here, driving.heading(self._onboard), self._home)
            self._onboard.enter("returning", f"home, {way.length_m(here):.0f} m")
            yield from driving.set_out(self._onboard, way)
            for _ in self._until_there(way, way.length_m(here)):
                if self._queue.waiting:
                    yield from driving.stop(self._onboard)
                    return
                yield
        except (steps.StepFailed, NoWay) as failure:
            self._astray = f"way home: {failure}"
            self._onboard.say(f"Not home: {failure}", WARNING)
            self._onboard.note("failed", self._astray)
        self._is_away = False
        yield from driving.park(self._onboard)
        self._onboard.enter("waiting", "for a target")

    def _look(self, job: Job) -> Script:
        """Until the target is confirmed, or the time is over. Raises StepFailed where no picture was looked at."""
        self._onboard.enter("inspecting", f"job {job.number}: looking for {job.wanted.label or 'the target'}")
        origin = Origin(job.lat_deg, job.lon_deg, None)
        _, confirming, look_rate_hz, _ = self.perception
        confirmation = Confirmation(self._camera, GROUND_DOWN_M, confirming)
        self._spotter = Spotter(self._telemetry, self._camera, self._mount, origin, confirmation, look_rate_hz)
        since_us, self._has_looked = self._onboard.own_us, False
        while job.found is not Result.CONFIRMED and self._onboard.own_us - since_us < self._look_us:
            if self._misfit:
                raise steps.StepFailed(self._misfit)
            yield
        if not self._has_looked:
            raise steps.StepFailed("no picture of where the target should be; look after the camera")
        self._spotter = None

    def _turn(self, job: Job, way: Way) -> Generator[None, None, Way]:
        """To face the target from the other side; the way by which it came there."""
        self._onboard.enter("turning", f"job {job.number}: to see the target from the other side")
        back = (-way.course[0], -way.course[1])
        if self._field_map is not None:
            here = yield from driving.here(self._onboard)
            round_ = self._way(here, job, back)
            yield from driving.set_out(self._onboard, round_)
            yield from self._until_there(round_, round_.length_m(here))
            return round_
        self._onboard.yielding.expect(())
        for ahead_m in (self.turn_m, self.approach_m):
            lat, lon = ways.beyond((job.lat_deg, job.lon_deg), way.course, ahead_m)
            place = self._telemetry.place
            altitude = place.alt_amsl_m if place is not None else 0.0
            yield from steps.go_to(self._onboard, lat, lon, altitude, self.arrival_m, self._drive_timeout_s)
        return Way(((lat, lon),), back)

    # Bookkeeping

    @property
    def _telemetry(self) -> Telemetry:
        return self._onboard.telemetry

    @property
    def _is_driven(self) -> bool:
        """Whether somebody else drives the vehicle, asked where it has no job: it is left in Hold, disarmed."""
        return self._telemetry.armed and self._telemetry.mode != "hold"

    def _see(self, job: Job, target: Target, away_m: float) -> None:
        """Something was confirmed where the target should be."""
        job.sights.append(Sight(target.label, target.score, away_m))
        lat, lon = from_metres(target.north_m, target.east_m, job.lat_deg, job.lon_deg)
        box = target.detection
        self._onboard.note(
            "inspected",
            f"job {job.number}: {target.label} seen {away_m:.1f} m ahead",
            job=job.number,
            label=target.label,
            score=target.score,
            lat_deg=lat,
            lon_deg=lon,
            distance_m=away_m,
            frame_time_us=target.frame_time_us,
            x=box.x,
            y=box.y,
            w=box.w,
            h=box.h,
        )
