"""The UGV's companion: takes a target from the peer link, drives there, looks, reports back.

The mission protocol from a peer passes through to the autopilot (`router.py`). When the autopilot has accepted a
mission of a peer, the companion starts it: mode MISSION, arm. It has arrived when it stands still within `arrival_m`
of the last waypoint. The target is then expected `approach_m` ahead, on the line on which it came (the waypoint is an
approach point, `scout.py`), and its camera looks for it: a detection within `match_m` of there, confirmed over 3
consecutive frames, ends the inspection. If that does not happen in `look_s`, the vehicle turns: an Ackermann rover
can't on the spot, so it drives `turn_m` on past the target, by DO_REPOSITION, and comes back to face it from the
other side, twice at most. The report (`report.py`) goes to the companion that sent the mission, until it is
acknowledged; the vehicle then holds and is disarmed until the next target.

A pilot who chooses another mode takes the vehicle over; the sender is told, and the inspection goes on when the mode is
given back.

Options: `approach_m`, `arrival_m`, `match_m`, `look_s`, `turn_m`, `drive_timeout_s`.
"""

import math
from collections.abc import Generator, Sequence
from typing import Any, NamedTuple

from gcs.command import arm, disarm, reposition
from gcs.geodesy import distance_m, from_metres, to_metres
from gcs.set_mode import set_mode
from gcs.statustext import WARNING
from gcs.telemetry import Pose, Telemetry
from missions.agriculture.report import Report, Result, command_of
from missions.companion.camera import Image
from missions.companion.camera_model import MAST, CameraModel, camera_pose, gsd_m
from missions.companion.companion import AUTOPILOT_LINK, PEER_LINK, Event, Outgoing, Status
from missions.companion.confirmation import Confirmation
from missions.companion.detector import ClassicalDetector, Detection, Detector
from missions.companion.onboard import Onboard, Script, advanced
from missions.companion.options import Options
from sitl_emu.core import dialect as mavlink

NAV_WAYPOINT = 16
AUTOPILOT_COMPONENT = 1
MAV_MISSION_ACCEPTED = 0
STILL_M_S = 0.15
STILL_US = 1_500_000
ARM_TRIES = 10
PAUSE_US = 1_500_000
DISARM_US = 3_000_000
TURNS = 2
UPLOAD_US = 10_000_000
"""An upload of which nothing has passed for so long was given up."""


class CantDrive(Exception):
    """The autopilot does not do what is needed; the text says what."""


class Job(NamedTuple):
    """A mission that a peer has given: who, and its last waypoint (1e-7 deg)."""

    sender: int
    x: int
    y: int


class Inspect:
    """The UGV's companion. See the module for what it does."""

    def __init__(
        self,
        detector: Detector,
        *,
        approach_m: float = 0.6,
        arrival_m: float = 2.0,
        match_m: float = 2.5,
        look_s: float = 3.0,
        turn_m: float = 8.0,
        drive_timeout_s: float = 240.0,
        camera: CameraModel | None = None,
    ) -> None:
        self.detector = detector
        self.approach_m, self.arrival_m, self.match_m, self.turn_m = approach_m, arrival_m, match_m, turn_m
        self._look_us, self._drive_timeout_us = round(look_s * 1e6), round(drive_timeout_s * 1e6)
        self._camera = camera or CameraModel()
        self._onboard = Onboard()
        self._now_us = 0
        self._phase, self._text = "connecting", "waiting for the autopilot"
        self._uploading: tuple[int, dict[int, tuple[int, int]]] | None = None
        """Who sends a mission now, and its waypoints so far."""
        self._uploading_us = 0
        self._jobs: list[Job] = []
        self._job: Job | None = None
        self._expected: tuple[float, float] | None = None
        """Where the target should be: metres north and east of the waypoint."""
        self._confirmation: Confirmation | None = None
        self._seen: tuple[str, float, float] | None = None
        self._told_pilot = False
        self._script: Script | None = self._run()

    @classmethod
    def from_options(cls, options: dict[str, Any]) -> "Inspect":
        """From a scenario's options. Raises ValueError for a wrong one."""
        given = Options(options)
        inspect = cls(
            ClassicalDetector(),
            approach_m=given.number("approach_m", 0.6, 0.0, 5.0),
            arrival_m=given.number("arrival_m", 2.0, 0.2, 20.0),
            match_m=given.number("match_m", 2.5, 0.2, 10.0),
            look_s=given.number("look_s", 3.0, 0.5, 60.0),
            turn_m=given.number("turn_m", 8.0, 3.0, 50.0),
            drive_timeout_s=given.number("drive_timeout_s", 240.0, 10.0, 3600.0),
        )
        given.end()
        return inspect

    @property
    def system_id(self) -> int:
        """MAVLink system of the UGV."""
        return self._onboard.system_id

    @property
    def status(self) -> Status:
        """Idle is done: there is nothing left to do until a peer sends the next target."""
        uploading = self._uploading is not None and self._now_us - self._uploading_us < UPLOAD_US
        idle = self._job is None and not self._jobs and not uploading
        phase = "yielded" if self._onboard.yielding.yielded_to is not None else self._phase
        return Status(phase, float(idle), idle, "success" if idle else "", self._text)

    def events(self) -> list[Event]:
        """The events since the last call."""
        return self._onboard.events()

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """Routes, and watches missions pass from a peer to the autopilot."""
        self._now_us = now_us
        _, out = self._onboard.on_message(now_us, link, msg)
        kind = msg.get_type()
        if kind.startswith("MISSION_") and any(passed is msg for _, passed in out):
            self._watch_upload(kind, msg)
        return out

    def wants_frame(self, frame_time_us: int) -> float | None:
        """Frames while it looks for the target."""
        pose = self._telemetry.pose_at(frame_time_us) if self._confirmation is not None else None
        if pose is None:
            return None
        return gsd_m(self._camera, camera_pose((0.0, 0.0, 0.0), pose.q, MAST), self._ground_down_m()) or 0.0

    def detect(self, image: Image, gsd: float) -> list[Detection]:
        """Runs the detector."""
        return self.detector.detect(image, gsd or None)

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[Detection]) -> Outgoing:
        """Confirms the expected target."""
        self._now_us = now_us
        pose = self._telemetry.pose_at(frame_time_us)
        if pose is None or self._confirmation is None or self._job is None or self._expected is None:
            return []
        seen_from = camera_pose(self._position(pose), pose.q, MAST)
        for target in self._confirmation.update(frame_time_us, seen_from, detections):
            away = math.hypot(target.north_m - self._expected[0], target.east_m - self._expected[1])
            if away <= self.match_m and self._seen is None:
                north, east, _ = self._position(pose)
                distance = math.hypot(target.north_m - north, target.east_m - east)
                self._seen = (target.label, target.score, distance)
                lat, lon = from_metres(target.north_m, target.east_m, self._job.x * 1e-7, self._job.y * 1e-7)
                box = target.detection
                self._onboard.note(
                    now_us,
                    "inspected",
                    f"{target.label} seen {distance:.1f} m ahead",
                    label=target.label,
                    score=target.score,
                    lat_deg=lat,
                    lon_deg=lon,
                    distance_m=distance,
                    frame_time_us=target.frame_time_us,
                    x=box.x,
                    y=box.y,
                    w=box.w,
                    h=box.h,
                )
        return []

    def on_time(self, now_us: int) -> Outgoing:
        """Goes on with the target at hand, unless a pilot has the vehicle."""
        self._now_us = now_us
        if not self._onboard.watch_pilot(now_us):
            self._told_pilot = False
            self._script = advanced(self._script)
        elif self._job is not None and not self._told_pilot:
            self._told_pilot = True
            self._onboard.start(PEER_LINK, command_of(self._job.sender, self._report(Result.PILOT_TOOK_OVER)))
        return self._onboard.on_time(now_us)

    # One target after the other

    def _run(self) -> Script:
        while not self._telemetry.system:
            yield
        while True:
            self._enter("waiting", "for a target")
            while not self._jobs:
                yield
            self._job = self._jobs.pop(0)
            try:
                result = yield from self._visit(self._job)
            except CantDrive as failure:
                self._onboard.say(self._now_us, f"Target not reached: {failure}", WARNING)
                self._onboard.note(self._now_us, "failed", str(failure))
                result = Result.NOT_REACHED
            self._confirmation = None
            self._enter("reporting", result.name.lower())
            report = yield from self._onboard.do(PEER_LINK, command_of(self._job.sender, self._report(result)))
            if report.outcome is None or not report.outcome.accepted:
                text = report.outcome.text if report.outcome is not None else "no answer"
                self._onboard.note(self._now_us, "failed", f"report: {text}")
            yield from self._park()
            self._job, self._expected, self._seen = None, None, None

    def _visit(self, job: Job) -> Generator[None, None, Result]:
        lat, lon = job.x * 1e-7, job.y * 1e-7
        place = self._telemetry.place
        start = to_metres(place.lat_deg, place.lon_deg, lat, lon) if place is not None else (0.0, 0.0)
        way = math.hypot(*start)
        course = (-start[0] / way, -start[1] / way) if way > 0.5 else None
        self._enter("starting", "mission mode, arming")
        yield from self._start_mission()
        self._onboard.note(self._now_us, "target_started", f"driving {way:.0f} m", lat_deg=lat, lon_deg=lon)
        self._enter("driving", f"{way:.0f} m to the target")
        yield from self._until_standing(lat, lon)
        stopped = self._telemetry.place
        assert stopped is not None
        self._onboard.note(
            self._now_us,
            "stopped",
            f"{distance_m(stopped.lat_deg, stopped.lon_deg, lat, lon):.2f} m from the waypoint",
            lat_deg=stopped.lat_deg,
            lon_deg=stopped.lon_deg,
            waypoint_lat_deg=lat,
            waypoint_lon_deg=lon,
        )
        attitude = self._telemetry.pose_at(stopped.time_us)
        if course is None:
            yaw = attitude.yaw_rad if attitude is not None else 0.0
            course = (math.cos(yaw), math.sin(yaw))
        self._expected = (course[0] * self.approach_m, course[1] * self.approach_m)
        self._enter("inspecting", "looking for the target")
        yield from self._look()
        for _ in range(TURNS):
            if self._seen is not None:
                break
            yield from self._turn(job, course)
            course = (-course[0], -course[1])
            yield from self._look()
        return Result.CONFIRMED if self._seen is not None else Result.NOT_SEEN

    def _start_mission(self) -> Script:
        system = self._telemetry.system
        self._onboard.yielding.expect(())
        mode = yield from self._onboard.do(AUTOPILOT_LINK, set_mode(system, "mission"))
        if mode.outcome is None or not mode.outcome.accepted:
            raise CantDrive(f"mission mode: {mode.outcome.text if mode.outcome else 'no answer'}")
        self._telemetry.mission_reached = None
        yield from self._arm()
        self._onboard.yielding.expect({"mission"})

    def _arm(self) -> Script:
        text = "no answer"
        for _ in range(ARM_TRIES):
            command = yield from self._onboard.do(AUTOPILOT_LINK, arm(self._telemetry.system))
            if command.outcome is not None and not command.outcome.accepted:
                text = command.outcome.text
            since_us = self._now_us
            while self._now_us - since_us < PAUSE_US and not self._telemetry.armed:
                yield
            if self._telemetry.armed:
                return
        raise CantDrive(f"arming: {text}")

    def _until_standing(self, lat: float, lon: float) -> Script:
        """Until it has stood for a while near a place."""
        began_us = still_since_us = self._now_us
        while self._now_us - still_since_us < STILL_US:
            place = self._telemetry.place
            away = distance_m(place.lat_deg, place.lon_deg, lat, lon) if place is not None else math.inf
            if self._telemetry.speed_m_s > STILL_M_S or away > self.arrival_m:
                still_since_us = self._now_us
            if self._now_us - began_us > self._drive_timeout_us:
                raise CantDrive(f"{away:.1f} m from the waypoint after {self._drive_timeout_us / 1e6:.0f} s")
            if not self._telemetry.armed:
                raise CantDrive("disarmed on the way")
            if self._telemetry.mission_reached is not None:
                self._onboard.yielding.expect({"mission", "hold"})  # PX4 holds by itself at a mission's end
            yield

    def _look(self) -> Script:
        """Until the target is confirmed, or the time is over."""
        self._confirmation = Confirmation(self._camera, self._ground_down_m(), settle=False)
        since_us = self._now_us
        while self._seen is None and self._now_us - since_us < self._look_us:
            yield
        self._confirmation = None

    def _turn(self, job: Job, course: tuple[float, float]) -> Script:
        """Past the target, and back to face it from the other side."""
        assert self._expected is not None
        self._enter("turning", "to bring the target into view")
        north, east = self._expected
        self._onboard.yielding.expect(())
        for ahead_m in (self.turn_m, self.approach_m):
            goal = (north + course[0] * ahead_m, east + course[1] * ahead_m)
            lat, lon = from_metres(*goal, job.x * 1e-7, job.y * 1e-7)
            place = self._telemetry.place
            altitude = place.alt_amsl_m if place is not None else 0.0
            move = yield from self._onboard.do(AUTOPILOT_LINK, reposition(self._telemetry.system, lat, lon, altitude))
            if move.outcome is None or not move.outcome.accepted:
                raise CantDrive(f"reposition: {move.outcome.text if move.outcome else 'no answer'}")
            self._onboard.yielding.expect({"hold"})
            yield from self._until_standing(lat, lon)
        self._enter("inspecting", "looking for the target")

    def _park(self) -> Script:
        """Holds and disarms, so that people may come near."""
        system = self._telemetry.system
        self._onboard.yielding.expect(())
        yield from self._onboard.do(AUTOPILOT_LINK, set_mode(system, "hold"))
        yield from self._onboard.do(AUTOPILOT_LINK, disarm(system))
        since_us = self._now_us
        while self._telemetry.armed and self._now_us - since_us < DISARM_US:
            yield

    # Bookkeeping

    @property
    def _telemetry(self) -> Telemetry:
        return self._onboard.telemetry

    def _watch_upload(self, kind: str, msg: mavlink.MAVLink_message) -> None:
        """Follows an upload of mission items that passes through."""
        if getattr(msg, "mission_type", 0) != 0:
            return
        self._uploading_us = self._now_us
        if kind == "MISSION_COUNT" and msg.get_srcSystem() != self.system_id:
            if self._uploading is None or self._uploading[0] != msg.get_srcSystem():
                self._uploading = (msg.get_srcSystem(), {})
        elif kind == "MISSION_ITEM_INT" and self._uploading is not None:
            if msg.command == NAV_WAYPOINT and msg.get_srcSystem() == self._uploading[0]:
                self._uploading[1][msg.seq] = (msg.x, msg.y)
        elif kind == "MISSION_ACK" and self._uploading is not None and msg.get_srcSystem() == self.system_id:
            sender, waypoints = self._uploading
            if msg.type == MAV_MISSION_ACCEPTED and waypoints:
                x, y = waypoints[max(waypoints)]
                self._jobs.append(Job(sender, x, y))
                self._onboard.note(self._now_us, "target_accepted", f"from system {sender}", system=sender)
            self._uploading = None

    def _report(self, result: Result) -> Report:
        assert self._job is not None
        label, score, distance = self._seen or ("", 0.0, math.nan)
        return Report(result, score, label, distance, self._job.x, self._job.y)

    def _position(self, pose: Pose) -> tuple[float, float, float]:
        """Metres north and east of the waypoint; the height is the vehicle's own: it stands on the ground."""
        assert self._job is not None
        north, east = to_metres(pose.lat_deg, pose.lon_deg, self._job.x * 1e-7, self._job.y * 1e-7)
        return north, east, 0.0

    @staticmethod
    def _ground_down_m() -> float:
        """The ground below the vehicle's centre: the mast's 2 m less what the mount has."""
        return 2.0 + MAST.down_m

    def _enter(self, phase: str, text: str) -> None:
        self._phase, self._text = phase, text
        self._onboard.note(self._now_us, "phase", f"{phase}: {text}", phase=phase)
