"""Several companions of the disaster mission, each with a stand-in for a PX4 on rails, over one bad radio.

The quadrotors take off, go where they are sent and land with PX4's speeds; each believes to be up to a metre from where
it is. What a camera sees are the parts of a picture that show ponds, without an error. No lidar, no wind, no renderer.
"""

import dataclasses
import math
import random
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from shapely import Polygon

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel
from sitl_emu.missions.companion.companion import PEER_LINK
from sitl_emu.missions.companion.detector import Areas, Detection, Detections
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.perception import Perception
from sitl_emu.missions.companion.release_point import Parcel
from sitl_emu.missions.companion.swarm.key import key_of
from sitl_emu.missions.disaster.detectors import CONFIRMING
from sitl_emu.missions.disaster.responder import Responder
from sitl_emu.missions.disaster.settings import Settings, Team
from tests.unit.companion_px4 import HOLD, RETURN, STEP_US, FakePx4, on_the_wire
from tests.unit.lossy_air import Air

ORIGIN, AMSL_M = (47.397742, 8.545594), 489.4
UNIX_US = 1_781_514_000_000_000
TAKEOFF = (4, 2)
CRUISE_M_S, CLIMB_M_S, ACC_M_S2 = 5.0, 2.0, 3.0
CAMERA = CameraModel(320, 240, 250.0, 250.0, 159.5, 119.5)
PART_PX, FRAME_US = 8, 500_000
LABEL = "water_body"


class Eye:
    """A detector that is never asked."""

    labels = (LABEL,)

    def detect(self, image: Any, gsd_m: float | None = None) -> Any:
        """See Detector."""
        raise AssertionError("no pictures here")


class Quad(FakePx4):
    """A quadrotor on rails; metres from its own home."""

    def __init__(self, system: int, pad_m: tuple[float, float], error_m: tuple[float, float, float]) -> None:
        super().__init__(system, 2, 0.0, 0.0, CRUISE_M_S)
        self.home = (*from_metres(pad_m[0] + error_m[0], pad_m[1] + error_m[1], *ORIGIN), AMSL_M + error_m[2])
        self.pad_m, self.error_m, self.height_m, self.dropped = pad_m, error_m, 0.0, False
        self.cruise_m_s = CRUISE_M_S
        self.fallen = False
        """It lies where it fell, armed, and talks on."""

    @property
    def true_m(self) -> tuple[float, float, float]:
        """Where it is: north, east, up."""
        return self.pad_m[0] + self.north_m, self.pad_m[1] + self.east_m, self.up_m

    def on_time(self, now_us: int) -> list[Any]:
        """Telemetry, with a receiver's and the time."""
        out = super().on_time(now_us)
        if self._due(now_us, "gps", 500_000):
            fix = mavlink.MAVLink_gps_raw_int_message(now_us, 3, 0, 0, 0, 0, 0, 0, 0, 16, 0, 600, 1000)
            time = mavlink.MAVLink_system_time_message(UNIX_US + now_us, now_us // 1000)
            out += [on_the_wire(msg, self.system, 1) for msg in (fix, time)]
        return out

    def land(self) -> None:
        """It is back on its pad at once, disarmed."""
        self.north_m = self.east_m = self.up_m = 0.0
        self.armed, self.mode, self.goal = False, HOLD, None

    def _obey(self, msg: Any) -> None:
        super()._obey(msg)
        if msg.command == 192:
            self.height_m = msg.z - self.home[2]
            self.cruise_m_s = msg.param1 if msg.param1 > 0.0 else CRUISE_M_S
        elif msg.command == 211:
            self.dropped = True

    def _move(self) -> list[Any]:
        dt, goal, height_m = STEP_US * 1e-6, self.goal, self.height_m
        if self.fallen:
            self.up_m, self.velocity = 0.0, (0.0, 0.0, 0.0)
            return []
        if self.mode == TAKEOFF:
            goal, height_m = (self.north_m, self.east_m), self.parameters["MIS_TAKEOFF_ALT"]
            if abs(self.up_m - height_m) < 0.1:
                self.mode, self.goal, self.height_m = HOLD, goal, height_m
        elif self.mode == RETURN:
            goal = (0.0, 0.0)
            height_m = 0.0 if math.hypot(self.north_m, self.east_m) < 0.5 else self.up_m
            if self.up_m <= 0.0 and height_m == 0.0:
                self.armed, self.mode = False, HOLD
        north, east = self._towards(goal if goal is not None else (self.north_m, self.east_m), dt)
        climb = min(max((height_m - self.up_m) / dt, -CLIMB_M_S), CLIMB_M_S)
        self.north_m, self.east_m = self.north_m + north * dt, self.east_m + east * dt
        self.up_m = max(0.0, self.up_m + climb * dt)
        self.velocity = (north, east, -climb)
        return []

    def _towards(self, goal: tuple[float, float], dt: float) -> tuple[float, float]:
        north_m, east_m = goal[0] - self.north_m, goal[1] - self.east_m
        away_m = math.hypot(north_m, east_m)
        speed = min(self.cruise_m_s, 0.8 * math.sqrt(2.0 * ACC_M_S2 * away_m), away_m / dt)
        wished = (north_m / away_m * speed, east_m / away_m * speed) if away_m > 1e-6 else (0.0, 0.0)
        change = wished[0] - self.velocity[0], wished[1] - self.velocity[1]
        most = ACC_M_S2 * dt / max(math.hypot(*change), ACC_M_S2 * dt)
        return self.velocity[0] + change[0] * most, self.velocity[1] + change[1] * most


class Gripper:
    """PX4's, in a quadrotor's place: it opens for `OPENS_US`, and what it is asked meanwhile is refused for now.

    The first `lost` of its answers, to whatever it is asked, do not arrive.
    """

    OPENS_US = 1_000_000
    """PD_GRIPPER_TO."""

    def __init__(self, quad: Quad, lost: int) -> None:
        self.lost = lost
        self._obey, self._asked_us = quad.on_message, 0
        quad.on_message = self.on_message  # type: ignore[method-assign]

    def on_message(self, now_us: int, msg: Any) -> list[Any]:
        """As `FakePx4.on_message`."""
        answers = self._obey(now_us, msg)
        if msg.get_type() != "COMMAND_LONG" or msg.command != 211:
            return answers
        self._asked_us = self._asked_us or now_us
        since_us = now_us - self._asked_us
        for answer in answers:
            answer.result = 5 if not since_us else 1 if since_us < self.OPENS_US else 0
        self.lost -= 1
        return answers if self.lost < 0 else []


class Flown(NamedTuple):
    """How it went."""

    seconds: float
    coverage_s: float
    nearest_m: float
    parcels: list[tuple[int, float, float]]
    """By whom, and where: north and east."""
    lines: dict[int, list[int]]
    """By system the lines that it has flown."""
    outcomes: dict[int, str]
    aborts: list[tuple[int, str]]
    lines_in_all: int


class Sky:
    """So many aircraft over an area with ponds."""

    def __init__(
        self,
        count: int,
        area_m: Sequence[tuple[float, float]],
        ponds: Sequence[Polygon],
        loss: float,
        seed: int,
        gather_timeout_s: float = 120.0,
        engage: str = "places",
    ) -> None:
        self.ponds = shapely.union_all(list(ponds))
        shapely.prepare(self.ponds)
        dice = random.Random(f"sky {seed}")
        self.systems = tuple(range(1, count + 1))
        errors = [(dice.uniform(-0.5, 0.5), dice.uniform(-0.5, 0.5), dice.uniform(-0.6, 0.6)) for _ in self.systems]
        self.quads = {
            system: Quad(system, (-8.0, 14.0 * (system - 1)), error)
            for system, error in zip(self.systems, errors, strict=True)
        }
        key = key_of(Options({"swarm_seed": seed}))
        team = Team(key, self.systems, AMSL_M, gather_timeout_s) if count > 1 else None
        corners = tuple(from_metres(*corner, *ORIGIN) for corner in area_m)
        settings = Settings(
            corners, (), Perception(Eye(), CONFIRMING), CAMERA, NADIR, Parcel(2.0, 0.045, 0.06), scan_altitude_m=15.0,
            release_height_m=10.0, margin_m=3.0, team=team, engage=engage,
        )  # fmt: skip
        self.companions = {system: Responder(settings) for system in self.systems}
        self.dead, self.mute = set[int](), set[int]()
        self.said = set[str]()
        """The kinds of messages on the peer link."""
        self.now_us, self._air, self._loss = 0, Air[Any](loss, seed), loss
        self.ground_m: Callable[[float, float], float] = lambda north_m, east_m: 0.0
        """How high the ground is over that at the origin, about a place; no vehicle meets it."""
        self.score, self.label = 0.8, LABEL
        """Of a box."""
        self.events = list[tuple[float, int, Any]]()
        self.nearest_m = math.inf
        self.parcels = list[tuple[int, float, float]]()

    def fly(self, until: float, *, then: Any = None) -> bool:
        """Goes on for so long, or until all that are not dead are done, or `then` says so; whether that came."""
        while self.now_us < until * 1e6:
            self._step()
            if then is not None and then(self):
                return True
            if all(self.companions[system].status.done for system in self.systems if system not in self.dead):
                return True
        return False

    def restart(self, system: int) -> None:
        """Its companion is started anew, and knows nothing of what was."""
        settings = self.companions[system].settings
        if settings.team is not None:
            key = dataclasses.replace(settings.team.key, session=self.now_us)
            settings = settings._replace(team=settings.team._replace(key=key))
        self.companions[system] = Responder(settings)

    def tells(self, system: int, kind: str, **data: str) -> bool:
        """Whether an aircraft has told of something (0: whichever)."""
        return any(
            system in (0, by) and event.kind == kind and data.items() <= event.data.items()
            for _, by, event in self.events
        )

    def flown(self) -> Flown:
        """All that happened."""
        lines = {
            system: [
                event.data["line"] for _, by, event in self.events if by == system and event.kind == "line_scanned"
            ]
            for system in self.systems
        }
        scans = [time_s for time_s, _, event in self.events if event.kind == "line_scanned"]
        up = [time_s for time_s, _, event in self.events if event.data.get("phase") == "taking off"]
        return Flown(
            self.now_us / 1e6,
            max(scans, default=math.nan) - min(up, default=math.nan),
            self.nearest_m,
            self.parcels,
            lines,
            {system: companion.status.outcome for system, companion in self.companions.items()},
            [(by, str(event.data["reason"])) for _, by, event in self.events if event.kind == "delivery_aborted"],
            len(self.companions[self.systems[0]].flight.lines),
        )

    def _step(self) -> None:
        self.now_us += STEP_US
        for receiver, sender, _, msg in self._air.due(self.now_us):
            if not {receiver, sender} & (self.mute | self.dead):
                self.companions[receiver].on_message(self.now_us, PEER_LINK, msg)
        for system in self.systems:
            self._fly(system)
        places = [quad.true_m for quad in self.quads.values() if quad.armed]
        for number, one in enumerate(places):
            for other in places[:number]:
                self.nearest_m = min(self.nearest_m, math.dist(one, other))

    def _fly(self, system: int) -> None:
        quad, companion, now_us = self.quads[system], self.companions[system], self.now_us
        telemetry, dropped = quad.on_time(now_us), quad.dropped
        if system in self.dead:
            return
        out = [each for msg in telemetry for each in companion.on_message(now_us, "autopilot", msg)]
        if now_us % FRAME_US == 0 and companion.wants_frame(now_us // 1000 * 1000) is not None:
            assert companion.looks, "else nobody would have drawn it"
            companion.on_detections(now_us, now_us // 1000 * 1000, self._seen(quad))
        out += companion.on_time(now_us)
        self.said |= {msg.get_type() for link, msg in out if link == PEER_LINK}
        for link, msg in out:
            if link == PEER_LINK and system not in self.mute:
                others = [other for other in self.systems if other != system]
                self._air.send(now_us, system, others, on_the_wire(msg, system, 191))
            elif link == "autopilot":
                for answer in quad.on_message(now_us, on_the_wire(msg, system, 191)):
                    companion.on_message(now_us, "autopilot", answer)
        self.events += [(now_us / 1e6, system, event) for event in companion.events()]
        if quad.dropped and not dropped:
            self.parcels.append((system, *quad.true_m[:2]))

    def _seen(self, quad: Quad) -> Detections:
        """The share of ponds in the parts of a picture; the camera's top is north."""
        north_m, east_m, up_m = quad.true_m
        up_m -= self.ground_m(north_m, east_m)
        rows, columns = CAMERA.height // PART_PX, CAMERA.width // PART_PX
        y, x = (np.mgrid[0:rows, 0:columns] + 0.5) * PART_PX
        north, east = north_m + (CAMERA.cy - y) / CAMERA.fy * up_m, east_m + (x - CAMERA.cx) / CAMERA.fx * up_m
        shares = shapely.contains_xy(self.ponds, north, east).astype(np.float32)
        boxes = self._boxes(shares) if self.companions[quad.system].settings.engage == "detections" else []
        return Detections(boxes, Areas((LABEL,), shares[None], PART_PX, 0.0, 0.0))

    def _boxes(self, shares: np.ndarray) -> list[Detection]:
        """About all that is in the picture."""
        rows, columns = np.nonzero(shares)
        if not len(rows):
            return []
        top, bottom = float(rows.min()) * PART_PX, float(rows.max() + 1) * PART_PX
        left, right = float(columns.min()) * PART_PX, float(columns.max() + 1) * PART_PX
        return [Detection(self.label, self.score, (left + right) / 2, (top + bottom) / 2, right - left, bottom - top)]
