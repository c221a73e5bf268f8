"""Scouts and UGVs of the agriculture mission, each with a stand-in for a PX4 on rails (companion_px4).

The detector knows the truth, the peer link is a list with a loss pattern, time is a loop.
"""

import math
from collections.abc import Callable
from typing import Any

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.gcs.mission import MissionItem
from sitl_emu.gcs.plan_file import FlightPlan
from sitl_emu.missions.agriculture.inspect import Inspect
from sitl_emu.missions.agriculture.scout import Scout
from sitl_emu.missions.companion.camera_model import MAST, NADIR, CameraModel, camera_pose, in_view, project
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK, PEER_LINK, Event
from sitl_emu.missions.companion.confirmation import STANDING, SURVEYING
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.perception import Perception
from sitl_emu.missions.companion.wire import Wire

from .companion_px4 import STEP_US, FakePx4

US = 1_000_000
HOME = (40.47, -86.99, 215.0)
CAMERA = CameraModel()
TARGETS = (("weed", 20.0, 6.0), ("disease", 34.0, 18.0))
THIRTY_PERCENT = "..x.x......x..x.x..."


def place(north_m: float, east_m: float) -> tuple[int, int]:
    lat, lon = from_metres(north_m, east_m, *HOME[:2])
    return round(lat * 1e7), round(lon * 1e7)


def plan() -> FlightPlan:
    track = ((0, 6), (40, 6), (40, 18), (0, 18))
    way = [MissionItem(3, 16, x=place(n, e)[0], y=place(n, e)[1], z=15.0) for n, e in track]
    takeoff = MissionItem(3, 22, x=place(0, 0)[0], y=place(0, 0)[1], z=15.0)
    fence = [MissionItem(0, 5001, 3.0, x=place(n, e)[0], y=place(n, e)[1]) for n, e in ((-50, -50), (90, 0), (0, 90))]
    return FlightPlan((takeoff, *way, MissionItem(2, 20)), tuple(fence), (), HOME)


class Node:
    """A companion with its autopilot; the wire between them loses nothing."""

    def __init__(self, companion: Any, px4: FakePx4, mount: Any) -> None:
        self.companion, self.px4, self.mount = companion, px4, mount
        self.wires = {AUTOPILOT_LINK: Wire(skip=()), PEER_LINK: Wire(skip=())}
        self.events: list[Event] = []
        self.peer_out: list[bytes] = []
        self.ground: list[Any] = []
        self.frame_us: int | None = None
        self.blind = False
        self.labels = {label: label for label, _, _ in TARGETS}
        """What the detector takes each kind of target for."""

    def send(self, now_us: int, outgoing: Any) -> None:
        for link, msg in outgoing:
            if msg.get_type() == "STATUSTEXT":
                self.ground.append(msg)
            wire = self.wires[link]
            wire.system = self.companion.system_id
            frame = wire.encode(msg)
            if link == PEER_LINK:
                self.peer_out.append(frame)
            else:
                for heard in Wire(skip=()).decode(frame):
                    for answer in self.px4.on_message(now_us, heard):
                        self.send(now_us, self.companion.on_message(now_us, AUTOPILOT_LINK, answer))

    def receive(self, now_us: int, frame: bytes) -> None:
        for msg in self.wires[PEER_LINK].decode(frame):
            self.send(now_us, self.companion.on_message(now_us, PEER_LINK, msg))

    def step(self, now_us: int) -> None:
        for msg in self.px4.on_time(now_us):
            self.send(now_us, self.companion.on_message(now_us, AUTOPILOT_LINK, msg))
        if now_us % 100_000 == 0:
            self.look(now_us)
        self.send(now_us, self.companion.on_time(now_us))
        self.events += self.companion.events()

    def look(self, now_us: int) -> None:
        """A frame of 60 ms ago, as the truth would show it."""
        frame_us = now_us // 50_000 * 50_000 - 60_000
        if frame_us < 0 or self.companion.wants_frame(frame_us) is None:
            return
        assert self.companion.looks, "else nobody would have drawn it"
        px4 = self.px4
        back = 0.06 + (now_us % 50_000) * 1e-6
        position = (px4.north_m - px4.velocity[0] * back, px4.east_m - px4.velocity[1] * back, -px4.up_m)
        if self.mount is MAST:
            position = (position[0], position[1], -0.2)
        pose = camera_pose(position, (math.cos(px4.yaw / 2), 0.0, 0.0, math.sin(px4.yaw / 2)), self.mount)
        found = []
        for label, north, east in TARGETS:
            if in_view(CAMERA, pose, (north, east, 0.0)) and not self.blind:
                x, y = project(CAMERA, pose, (north, east, 0.0)) or (0.0, 0.0)
                found.append(Detection(self.labels[label], 0.9, x, y, 30.0, 30.0))
        self.send(now_us, self.companion.on_detections(now_us, frame_us, found))

    def of(self, kind: str) -> list[Event]:
        return [event for event in self.events if event.kind == kind]


class NoDetector:
    labels = ("weed", "disease")

    def detect(self, image: Any, gsd_m: float | None = None) -> list[Detection]:
        return []


LOOKS, STANDS = Perception(NoDetector(), SURVEYING), Perception(NoDetector(), STANDING)


def pair(**scout_options: Any) -> tuple[Node, Node]:
    uas = FakePx4(1, 13, 0.0, 0.0, 5.0)
    ugv = FakePx4(2, 10, -30.0, 40.0, 2.5)
    scout = Node(Scout(plan(), LOOKS, **scout_options), uas, NADIR)
    return scout, Node(Inspect(STANDS), ugv, MAST)


def fly(
    scout: Node,
    inspect: Node,
    lost: Callable[[int], bool] = lambda now_us: False,
    each: Callable[[int], None] = lambda now_us: None,
    limit_s: float = 400.0,
) -> float:
    """Runs both until the scout is done and the other idle; `lost(now_us)` says whether a peer frame is lost."""
    return fly_all([scout, inspect], lost, each, limit_s)


def fly_all(
    nodes: list[Node],
    lost: Callable[[int], bool] = lambda now_us: False,
    each: Callable[[int], None] = lambda now_us: None,
    limit_s: float = 400.0,
) -> float:
    """Runs all until they are done; what one sends by radio all others hear."""
    for now_us in range(0, round(limit_s * US), STEP_US):
        each(now_us)
        for one in nodes:
            one.step(now_us)
            frames, one.peer_out = one.peer_out, []
            for frame in frames:
                for other in nodes:
                    if other is not one and not lost(now_us):
                        other.receive(now_us, frame)
        if all(node.companion.status.done for node in nodes):
            return now_us / US
    raise AssertionError(f"not done: {[node.companion.status for node in nodes]}")
