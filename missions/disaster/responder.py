"""The UAS's companion: scans an area, finds water, debris or fire, and delivers its parcel at the edge of one.

`flight.py` says what it flies, `regions.py` when something is confirmed and which sightings are one target, `places.py`
which point of an area is located and where the parcel goes, `aborts.py` when the parcel stays on board.

**The mission is a success** when the whole area was seen, and the parcel was delivered if anything was found.

**A pilot or a failsafe** that chooses another mode than Hold takes the vehicle over: no more commands to it until the
mode is the companion's again; the mission ends when the vehicle is disarmed, with which of the two it was as outcome.

Options: `area` (needed; a polygon in degrees with holes, in a simulated run also `world` or metres, `plans.py`),
`scan_altitude_m`, `scan_speed_m_s`, `release_height_m`, `ground_sigma_m`, `overlap`, `margin_m` (of lines from the
area's edge), `fence_margin_m` (the geofence's, around area and home), `location` (`rays`, `equations`), `altitude`
(`fixed`, `terrain`), `engage` (`places`, `detections`), `terrain_map` (a GeoTIFF to write), `parcel` (`yes`, `no`),
`parcel_mass_kg`, `parcel_drag_m2`, `parcel_half_height_m`, `ready_timeout_s`, `calibration`, `confirmations`,
`confirm_score`, and of `companion/perception.py` detector, selection, look_rate_hz. For several aircraft
(`together.py`), which have all other options alike: `members` (their MAVLink systems), `datum_amsl_m`, `swarm_key`; a
simulated run adds the first two and a key of its seed, where several vehicles have this mission with the same options;
and `gather_timeout_s`, for which each waits on the ground for those that it has not heard yet.
"""

import math
from collections.abc import Sequence

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.statustext import CRITICAL, INFO, WARNING
from sitl_emu.gcs.telemetry import LOOKS_DOWN
from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.companion import PEER_LINK, Event, Outgoing, Status
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.onboard import Onboard, Script, advanced
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.spotter import Origin, camera_pose_at, camera_sweep_at, position
from sitl_emu.missions.disaster import telling
from sitl_emu.missions.disaster.alarms import Alarms
from sitl_emu.missions.disaster.as_printed import AsPrinted
from sitl_emu.missions.disaster.drop import View
from sitl_emu.missions.disaster.flight import LOOKS_FROM_M, LOOKS_WITHIN_RAD, WHOLE, Flight
from sitl_emu.missions.disaster.settings import Settings, settings_of
from sitl_emu.missions.disaster.sight import Eye, Sight
from sitl_emu.missions.disaster.sightings import Sightings


class Responder:
    """The UAS's companion. See the module for what it does."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._onboard = Onboard(is_open=False)
        self.flight = (AsPrinted if settings.engage == "detections" else Flight)(self._onboard, settings)
        self.flight.seen = self._seen
        self._script: Script | None = self.flight.script()
        self._eye = Eye(settings.perception.detector)
        self._frames = self._look_us = self._range_us = 0
        self._boxes: dict[str, tuple[int, Detection]] = {}
        """By label: the frame that showed it last, and the best box in it."""
        self._sightings = Sightings(settings.camera, settings.location)
        self._alarms = Alarms(settings.camera, settings.perception.confirming.confirm_score, self._is_asked)
        self._misfit = ""
        """What is wrong with the pictures' size (`CameraModel.misfit`)."""
        self._outcome, self._failure = "", ""
        self._done = False

    @classmethod
    def from_options(cls, given: Options) -> "Responder":
        """From a scenario's options. Raises ValueError for a wrong one."""
        return cls(settings_of(given))

    @property
    def system_id(self) -> int:
        """MAVLink system of the UAS."""
        return self._onboard.system_id

    @property
    def status(self) -> Status:
        """Where the mission stands."""
        flight = self.flight
        progress = 1.0 if self._done else 0.9 * flight.scanned / max(len(flight.lines), 1)
        counts = {"frames looked at": self._frames, "lines scanned": flight.scanned}
        if flight.together is not None:
            counts |= flight.together.counts
        return Status(self._onboard.shown_phase, progress, self._done, self._outcome, self._onboard.text, counts)

    def events(self) -> list[Event]:
        """The events since the last call."""
        return self._onboard.events()

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """A message came in."""
        if link == PEER_LINK and self.flight.together is not None:
            self.flight.together.on_message(now_us, msg)
        return self._onboard.on_message(now_us, link, msg)[1]

    @property
    def looks(self) -> bool:
        """While its flight has use for it."""
        return self.flight.looking

    def wants_frame(self, frame_time_us: int) -> float | None:
        """Frames taken high enough and from above, as long as it looks at all."""
        flight, rate_hz = self.flight, self.settings.perception.look_rate_hz
        if not flight.looking or (rate_hz and frame_time_us < self._look_us):
            return None
        pose = camera_pose_at(self._onboard.telemetry, frame_time_us, self.settings.mount, Origin(*flight.home))
        if pose is None or pose.to_ned[2, 2] < math.cos(LOOKS_WITHIN_RAD) or flight.over_ground_m < LOOKS_FROM_M:
            return None
        if rate_hz:
            self._look_us = max(self._look_us + round(1e6 / rate_hz), frame_time_us)
        return flight.over_ground_m / self.settings.camera.focal_px

    def detect(self, image: Image, gsd_m: float) -> Sequence[Detection]:
        """Runs the detector, looks for edges, follows corners. A picture of a size that is not the camera's: nothing.

        Where such pictures lie on the ground is not known: with the next `on_detections` the mission fails.
        """
        misfit = self.settings.camera.misfit(*image.shape[:2])
        if misfit:
            self._misfit = misfit
            return []
        return self._eye.look(image, gsd_m)

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[Detection]) -> Outgoing:
        """Puts a frame's detections into the map."""
        self._onboard.now_us = now_us
        flight = self.flight
        if self._misfit:
            if not self._failure:
                self._fail(self._misfit)
            return []
        settings, telemetry, home = self.settings, self._onboard.telemetry, Origin(*flight.home)
        pose = camera_pose_at(telemetry, frame_time_us, settings.mount, home)
        if pose is None or flight.regions is None:
            return []
        self._frames += 1
        for box in sorted(detections, key=lambda each: each.score):
            self._boxes[box.label] = frame_time_us, box
        edges = None
        if isinstance(detections, Sight):
            edges = detections.edges
            eph_m, epv_m = telemetry.eph_m or 0.0, telemetry.epv_m or 0.0
            sweep = camera_sweep_at(telemetry, frame_time_us, settings.camera, settings.mount, home)
            if sweep is not None:
                flight.ground.on_features(frame_time_us, sweep, detections.features, eph_m, epv_m)
            if detections.gray is not None:
                flight.view = View(frame_time_us, detections.gray, pose)
        ground_m = flight.ground.heights_m(now_us)
        flight.regions.update(pose, ground_m, detections, edges)
        if flight.over_ground_m >= WHOLE * flight.settings.scan_altitude_m:
            for one in self._sightings.new(pose, detections, flight.regions, ground_m):
                telling.sighting(self._onboard, one, flight.place_deg)
            self._alarms.update(now_us, frame_time_us, pose, detections)
            flight.look(pose, detections, ground_m)
        return []

    def _is_asked(self, north_m: float, east_m: float) -> bool:
        """Whether a place is in the area."""
        return self.flight.regions is not None and self.flight.regions.is_asked(north_m, east_m)

    def on_time(self, now_us: int) -> Outgoing:
        """Goes on with the flight, unless a pilot or a failsafe has the vehicle."""
        onboard = self._onboard
        self._measure()
        if not onboard.watch_pilot(now_us):
            try:
                self._script = advanced(self._script)
            except steps.StepFailed as failure:
                self._fail(str(failure))
            if self._script is None and not self._done:
                self._end(self._failure or self.flight.outcome)
        elif not onboard.telemetry.armed and not self._done:
            self._end(self._failure or onboard.taken_by)
        out = onboard.on_time(now_us)
        return out if self.flight.together is None else out + self.flight.together.on_time(now_us, over=self._done)

    def _measure(self) -> None:
        """Puts the lidar's new ranges into the terrain map."""
        telemetry = self._onboard.telemetry
        if self.flight.regions is None:
            return
        for one in telemetry.ranges:
            pose = telemetry.pose_at(one.time_us) if one.time_us > self._range_us else None
            if pose is not None and one.orientation == LOOKS_DOWN:
                self._range_us = one.time_us
                place = position(pose, Origin(*self.flight.home))
                eph_m, epv_m = telemetry.eph_m or 0.0, telemetry.epv_m or 0.0
                self.flight.ground.survey.on_range(one.time_us, one.distance_m, place, pose.q, eph_m, epv_m)

    def _seen(self, label: str) -> dict[str, float | int]:
        if label not in self._boxes:
            return {}
        frame_time_us, box = self._boxes[label]
        return {"frame_time_us": frame_time_us, "x": box.x, "y": box.y, "w": box.w, "h": box.h}

    def fail(self, why: str) -> None:
        """It can't see any more."""
        if self.flight.looking:
            self._fail(why)

    def _fail(self, why: str) -> None:
        """The mission can't go on: says so, and brings the UAS home, if it has begun."""
        first, self._failure = not self._failure, self._failure or why
        self._onboard.say(f"Mission: {why}", CRITICAL)
        self._onboard.note("failed", why)
        self.flight.looking = False
        self._script = self._home() if first else None

    def _home(self) -> Script:
        self._onboard.enter("failed", self._failure)
        if self.flight.regions is None:
            return  # nothing was asked of it yet, and who has it armed may fly it
        yield from steps.return_home(self._onboard)
        self._onboard.yielding.expect(())

    def _end(self, outcome: str) -> None:
        self._done, self._outcome, self._script = True, outcome, None
        self.flight.looking = False
        if self.flight.regions is not None:
            telling.alarms(self._onboard, self._alarms.all, self.flight.place_deg)
        self._onboard.say(f"Mission ends: {outcome}", INFO if outcome == "success" else WARNING)
