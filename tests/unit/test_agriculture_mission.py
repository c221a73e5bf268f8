"""Scout and inspect fly and drive a whole mission as state machines: on rails, with a detector that knows the truth.

Both autopilots are stand-ins (companion_px4), the peer link is a list with a loss pattern, time is a loop.
"""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.gcs.mission import MissionItem
from sitl_emu.gcs.plan_file import FlightPlan
from sitl_emu.missions.agriculture import field_map
from sitl_emu.missions.agriculture.inspect import Inspect
from sitl_emu.missions.agriculture.jobs import Wanted, items_of
from sitl_emu.missions.agriculture.row_route import is_among_rows
from sitl_emu.missions.agriculture.scout import Scout
from sitl_emu.missions.companion.camera_model import MAST, NADIR, CameraModel, camera_pose, in_view, project
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK, GROUND_LINK, PEER_LINK, Event
from sitl_emu.missions.companion.confirmation import STANDING, SURVEYING
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.perception import Perception
from sitl_emu.missions.companion.wire import Wire
from tests.unit.companion_px4 import HOLD, MISSION, POSITION, RETURN, STEP_US, FakePx4

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
            if link == GROUND_LINK:
                self.ground.append(msg)
                continue
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


def three_scouts() -> tuple[list[Node], Node]:
    """Three scouts that fly the same lines, one after the other by a few metres, and the one UGV they share."""
    scouts = [Node(Scout(plan(), LOOKS), FakePx4(system, 13, 0.0, 4.0 * system, 5.0), NADIR) for system in (1, 3, 4)]
    return scouts, Node(Inspect(STANDS), FakePx4(2, 10, -30.0, 40.0, 2.5), MAST)


@pytest.mark.parametrize("pattern", [".", THIRTY_PERCENT])
def test_every_target_is_found_sent_driven_to_and_reported(pattern: str) -> None:
    scout, inspect = pair()
    signs = itertools.cycle(pattern)
    fly(scout, inspect, lambda now_us: next(signs) == "x")
    assert scout.companion.status.outcome == "success"
    confirmed = scout.of("target_confirmed")
    assert sorted(event.data["label"] for event in confirmed) == ["disease", "weed"]
    for event in confirmed:
        north, east = to_metres(float(event.data["lat_deg"]), float(event.data["lon_deg"]), *HOME[:2])
        assert min(math.dist((north, east), target[1:]) for target in TARGETS) < 0.5
    assert len(scout.of("target_accepted")) == 2
    stops = inspect.of("stopped")
    assert len(stops) == 2
    for stop in stops:
        stopped = to_metres(float(stop.data["lat_deg"]), float(stop.data["lon_deg"]), *HOME[:2])
        assert 0.3 < min(math.dist(stopped, target[1:]) for target in TARGETS) < 1.5
    assert [event.data["result"] for event in scout.of("report_received")] == ["confirmed", "confirmed"]
    assert not scout.px4.armed
    assert not inspect.px4.armed


def test_the_plan_is_uploaded_whole_before_arming() -> None:
    scout, inspect = pair(return_altitude_m=20.0)
    fly(scout, inspect)
    assert [item.command for item in scout.px4.missions.items[0]] == [22, 16, 16, 16, 16, 20]
    assert len(scout.px4.missions.items[1]) == 3
    assert scout.px4.parameters == {"RTL_RETURN_ALT": 20.0}
    assert [command for command, _ in scout.px4.commands[:2]] == [176, 400]


def test_the_scan_goes_on_while_the_ugv_drives() -> None:
    scout, inspect = pair()
    fly(scout, inspect)
    started = inspect.of("target_started")[0].time_us
    landed = next(event for event in scout.of("phase") if event.data["phase"] == "landed").time_us
    returning = next(event for event in scout.of("phase") if event.data["phase"] == "returning").time_us
    assert started < returning < landed


def test_a_cut_peer_link_is_told_and_the_uas_returns_home() -> None:
    scout, inspect = pair()
    fly(scout, inspect, lambda now_us: True, limit_s=200.0)
    assert scout.companion.status.outcome == "peer link lost"
    assert math.hypot(scout.px4.north_m, scout.px4.east_m) < 1.0
    assert not scout.px4.armed
    assert scout.of("peer_lost")
    assert inspect.px4.missions.accepted == 0


def test_a_peer_link_that_breaks_while_the_ugv_drives_is_told_after_the_time_out() -> None:
    scout, inspect = pair()
    cut: list[int] = []

    def lost(now_us: int) -> bool:
        if not cut and scout.of("target_accepted"):
            cut.append(now_us)
        return bool(cut)

    fly(scout, inspect, lost)
    assert scout.companion.status.outcome == "peer link lost"
    assert scout.of("peer_lost")[0].time_us - cut[0] == pytest.approx(20 * US, abs=1.5 * US)


def test_the_link_may_fail_for_a_while() -> None:
    scout, inspect = pair()
    fly(scout, inspect, lambda now_us: 12 * US < now_us < 27 * US)
    assert scout.companion.status.outcome == "success"


def test_the_scout_yields_to_a_pilot_and_resumes_when_given_back() -> None:
    scout, inspect = pair()
    heard: list[int] = []

    def pilot(now_us: int) -> None:
        if now_us == 15 * US:
            scout.px4.mode = POSITION
        if now_us == 20 * US:
            assert scout.companion.status.phase == "yielded"
            heard.append(len(scout.px4.commands))
        if now_us == 30 * US:
            heard.append(len(scout.px4.commands))
            scout.px4.mode = MISSION

    fly(scout, inspect, each=pilot)
    assert heard[0] == heard[1]
    assert "position" in scout.of("yielded")[0].text
    assert any("yields" in str(msg.text) for msg in scout.ground if msg.get_type() == "STATUSTEXT")
    assert scout.of("resumed")
    assert scout.companion.status.outcome == "success"


def test_a_pilot_who_lands_the_uas_ends_the_mission() -> None:
    scout, inspect = pair()

    def pilot(now_us: int) -> None:
        if now_us == 15 * US:
            scout.px4.mode = (4, 6)
        if now_us == 20 * US:
            scout.px4.armed, scout.px4.mode, scout.px4.up_m = False, HOLD, 0.0

    fly(scout, inspect, each=pilot)
    assert scout.companion.status.outcome == "pilot took over"


def test_a_pilot_on_the_ugv_is_reported_to_the_scout() -> None:
    scout, inspect = pair()
    taken: list[int] = []

    def pilot(now_us: int) -> None:
        if not taken and inspect.of("target_started") and now_us > inspect.of("target_started")[0].time_us + 2 * US:
            taken.append(now_us)
            inspect.px4.mode = POSITION
        if taken and now_us == taken[0] + 10 * US:
            assert inspect.companion.status.phase == "yielded"
            assert scout.of("report_received")[0].data["result"] == "pilot_took_over"
            inspect.px4.mode = MISSION

    fly(scout, inspect, each=pilot)
    assert taken
    assert scout.of("report_received")[1].data["result"] == "confirmed"


def test_a_failsafe_that_takes_the_uas_home_is_told_apart_from_a_pilot() -> None:
    scout, inspect = pair()

    def low_battery(now_us: int) -> None:
        if now_us == 15 * US:
            scout.px4.enter_failsafe(now_us, RETURN, cause=3)

    fly(scout, inspect, each=low_battery)
    yielded = scout.of("yielded")
    assert [(event.data["by"], event.data["mode"]) for event in yielded] == [("failsafe", "return")]
    said = [str(msg.text) for msg in scout.ground if msg.get_type() == "STATUSTEXT"]
    assert "Companion yields: failsafe (low battery), mode" in " ".join(said)
    assert not any("pilot" in text for text in said)
    assert scout.companion.status.outcome == "failsafe (low battery)"


def test_a_pilot_who_takes_over_from_a_failsafe_is_told_too() -> None:
    scout, inspect = pair()

    def pilot(now_us: int) -> None:
        if now_us == 15 * US:
            scout.px4.enter_failsafe(now_us, RETURN, cause=2)
        if now_us == 18 * US:
            scout.px4.choose(POSITION)
        if now_us == 25 * US:
            scout.px4.choose(MISSION)

    fly(scout, inspect, each=pilot)
    assert [event.text for event in scout.of("yielded")] == [
        "failsafe (ground station lost), mode return",
        "pilot took over, mode position",
    ]
    assert scout.of("resumed")
    assert scout.companion.status.outcome == "success"


def test_a_failsafe_of_the_ugv_is_reported_to_the_scout_as_one() -> None:
    scout, inspect = pair()
    taken: list[int] = []

    def link_lost(now_us: int) -> None:
        if not taken and inspect.of("target_started") and now_us > inspect.of("target_started")[0].time_us + 2 * US:
            taken.append(now_us)
            inspect.px4.enter_failsafe(now_us, HOLD, cause=2)
        if taken and now_us == taken[0] + 10 * US:
            assert scout.of("report_received")[0].data["result"] == "failsafe"
            inspect.px4.choose(MISSION)

    fly(scout, inspect, each=link_lost)
    assert taken
    assert inspect.of("yielded")[0].text == "failsafe (ground station lost), mode hold"
    assert [event.data["result"] for event in scout.of("report_received")][:2] == ["failsafe", "confirmed"]


def test_a_target_that_the_ugv_does_not_see_makes_it_turn_and_then_say_so() -> None:
    scout, inspect = pair()
    inspect.blind = True
    fly(scout, inspect)
    assert {event.data["result"] for event in scout.of("report_received")} == {"not_seen"}
    turned = [event for event in inspect.of("phase") if event.data["phase"] == "turning"]
    assert len(turned) == 2 * len(TARGETS)
    assert scout.companion.status.outcome == f"target {scout.companion.jobs[0].target.id}: not seen"
    assert inspect.companion.status.outcome == "job 1: not seen"


FIELD = field_map.read(
    {
        "origin": HOME[:2],
        "outline_m": [[0, 0], [0, 30], [60, 30], [60, 0]],
        "rows_deg": 0,
        "first_row_m": 3,
        "row_spacing_m": 0.75,
        "headland_m": 3,
        "margin_m": 3,
    }
)


def pair_among_rows(blind: bool = False) -> tuple[Node, Node]:
    scout, _ = pair()
    inspect = Node(Inspect(STANDS, field_map=FIELD), FakePx4(2, 10, 1.5, 28.5, 2.5), MAST)
    inspect.blind = blind
    return scout, inspect


@pytest.mark.parametrize("blind", [False, True])
def test_among_rows_the_ugv_drives_along_them_and_home_in_the_end(blind: bool) -> None:
    scout, inspect = pair_among_rows(blind)
    track = list[tuple[float, float]]()
    fly(scout, inspect, each=lambda _: track.append((inspect.px4.north_m, inspect.px4.east_m)), limit_s=1500.0)
    lanes = [(here[1], FIELD.lane_m(here[1])) for here in track if is_among_rows(FIELD, here)]
    assert len(lanes) > 1000 and all(east_m == pytest.approx(lane_m, abs=0.03) for east_m, lane_m in lanes)
    assert math.dist(track[-1], (1.5, 28.5)) < 1.0 and not inspect.px4.armed
    results = {event.data["result"] for event in scout.of("report_received")}
    assert results == ({"not_seen"} if blind else {"confirmed"})
    turned = [event for event in inspect.of("phase") if event.data["phase"] == "turning"]
    assert len(turned) == (2 * len(TARGETS) if blind else 0)
    assert [event.data["job"] for event in inspect.of("stopped")] == [1, 2]


def test_a_ugv_on_its_way_home_turns_round_for_a_job() -> None:
    scout, inspect = pair_among_rows()
    asked = list[int]()
    late = from_metres(50.0, 10.0, *HOME[:2])

    def ask(now_us: int) -> None:
        """Somebody else's target, once the UGV has been on its way home for 2 s."""
        returning = [event for event in inspect.of("phase") if event.data["phase"] == "returning"]
        if not asked and returning and now_us > returning[0].time_us + 2 * US:
            asked.append(now_us)
            wanted = Wanted(round(late[0] * 1e7), round(late[1] * 1e7), "weed", 0.9)
            inspect.companion._asked(9, items_of(wanted))

    fly(scout, inspect, each=ask, limit_s=1500.0)
    assert asked and [event.data["job"] for event in inspect.of("stopped")] == [1, 2, 3]
    phases = [event.data["phase"] for event in inspect.of("phase")]
    assert phases.count("returning") == 2
    assert math.dist((inspect.px4.north_m, inspect.px4.east_m), (1.5, 28.5)) < 1.0


def test_a_way_home_that_fails_is_the_ugvs_outcome_and_is_not_tried_for_ever() -> None:
    scout, inspect = pair_among_rows()

    def refuse(_: int) -> None:
        inspect.px4.missions.refuse = 14 if len(inspect.of("stopped")) == 2 else None

    fly(scout, inspect, each=refuse, limit_s=1500.0)
    assert inspect.companion.status.outcome == "way home: upload of mission failed: denied"
    assert scout.companion.status.outcome == "success"


def test_a_refused_arming_is_tried_again_and_then_told() -> None:
    scout, inspect = pair()
    scout.px4.ack = lambda command: 1 if command == 400 else 0
    fly(scout, inspect)
    assert scout.companion.status.outcome == "arming refused: temporarily rejected"
    assert sum(command == 400 for command, _ in scout.px4.commands) == 20


def test_a_mission_that_the_ugvs_autopilot_refuses_is_told() -> None:
    scout, inspect = pair()
    inspect.px4.missions.refuse = 14
    fly(scout, inspect)
    assert {event.data["result"] for event in scout.of("report_received")} == {"not_reached"}
    assert "upload of mission failed: denied" in inspect.of("failed")[0].text
    assert scout.companion.status.outcome == f"target {scout.companion.jobs[0].target.id}: not reached"
    assert inspect.px4.missions.accepted == 0


def test_one_ugv_serves_what_three_scouts_ask_for_once_each_and_tells_all_of_them() -> None:
    scouts, inspect = three_scouts()
    fly_all([*scouts, inspect], limit_s=600.0)
    assert [scout.companion.status.outcome for scout in scouts] == ["success"] * 3
    for scout in scouts:
        assert [event.data["result"] for event in scout.of("report_received")] == ["confirmed", "confirmed"]
        assert sorted(str(event.data["label"]) for event in scout.of("report_received")) == ["disease", "weed"]
    assert [event.data["job"] for event in inspect.of("target_started")] == [1, 2]
    assert [event.data["job"] for event in inspect.of("stopped")] == [1, 2]
    assert inspect.px4.missions.accepted == 2
    accepted = inspect.of("target_accepted")
    assert sorted((event.data["job"], event.data["system"]) for event in accepted) == [
        (job, system) for job in (1, 2) for system in (1, 3, 4)
    ]
    assert not inspect.px4.armed


def test_with_loss_each_way_three_scouts_are_served_all_the_same() -> None:
    scouts, inspect = three_scouts()
    signs = itertools.cycle(THIRTY_PERCENT)
    fly_all([*scouts, inspect], lambda now_us: next(signs) == "x", limit_s=600.0)
    assert [scout.companion.status.outcome for scout in scouts] == ["success"] * 3
    assert inspect.px4.missions.accepted == 2


def test_the_ugv_is_sent_next_to_the_target_that_is_nearest_to_where_it_says_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The second was found before the third, which lies nearer to the first, where the UGV then is."""
    targets = (("weed", 10.0, 6.0), ("disease", 34.0, 6.0), ("weed", 12.0, 24.0))
    monkeypatch.setattr("tests.unit.test_agriculture_mission.TARGETS", targets)
    scout, inspect = pair()
    fly(scout, inspect)
    assert [event.data["label"] for event in scout.of("target_confirmed")] == ["weed", "disease", "weed"]
    places = [
        to_metres(float(event.data["lat_deg"]), float(event.data["lon_deg"]), *HOME[:2])
        for event in scout.of("target_sent")
    ]
    nearest = [min(range(3), key=lambda i: math.dist(targets[i][1:], place)) for place in places]
    assert nearest == [0, 2, 1]


def two_ugvs() -> tuple[Node, list[Node]]:
    """A scout and two UGVs, each nearer to one of the targets."""
    places = ((2, -20.0, 0.0), (3, 60.0, 30.0))
    ugvs = [Node(Inspect(STANDS), FakePx4(system, 10, n, e, 2.5), MAST) for system, n, e in places]
    return Node(Scout(plan(), LOOKS), FakePx4(1, 13, 0.0, 0.0, 5.0), NADIR), ugvs


def test_two_ugvs_share_what_one_scout_finds_at_the_same_time() -> None:
    scout, ugvs = two_ugvs()
    fly_all([scout, *ugvs])
    assert scout.companion.status.outcome == "success"
    assert {event.data["system"] for event in scout.of("target_sent")} == {2, 3}
    driving = [(ugv.of("target_started")[0].time_us, ugv.of("inspected")[0].time_us) for ugv in ugvs]
    assert max(start for start, _ in driving) < min(end for _, end in driving)
    assert [len(ugv.of("stopped")) for ugv in ugvs] == [1, 1]


def test_a_target_of_a_ugv_that_falls_silent_goes_to_the_other_one() -> None:
    scout, (one, other) = two_ugvs()
    gone: list[int] = []

    def leave(now_us: int) -> None:
        if not gone and one.of("target_started"):
            gone.append(now_us)
            one.receive = one.step = lambda *_: None  # type: ignore[method-assign, assignment]

    with pytest.raises(AssertionError, match="not done"):
        fly_all([scout, one, other], each=leave)  # the one that has gone never says that it is
    assert gone
    assert scout.companion.status.outcome == "success"
    assert [event.data["system"] for event in scout.of("peer_lost")] == [2]
    assert len(other.of("stopped")) == len(TARGETS)


def test_an_upload_during_a_drive_leaves_the_drive_alone() -> None:
    scouts, inspect = three_scouts()
    heading: dict[int, set[tuple[int, int]]] = {}

    def watch(now_us: int) -> None:
        """Where the UGV's autopilot is sent while each job is at hand."""
        started, driving = inspect.of("target_started"), inspect.companion.status.phase == "driving"
        if driving and inspect.px4.missions.items[0]:
            item = inspect.px4.missions.items[0][0]
            heading.setdefault(int(started[-1].data["job"]) if started else 0, set()).add((item.x, item.y))

    fly_all([*scouts, inspect], each=watch, limit_s=600.0)
    others = [event.time_us for event in inspect.of("target_accepted")]
    first, stopped = inspect.of("target_started")[0].time_us, inspect.of("stopped")[0].time_us
    assert any(first < time_us < stopped for time_us in others)  # or nothing has been tested
    assert {job: len(places) for job, places in heading.items()} == {1: 1, 2: 1}


def test_a_scout_that_has_gone_does_not_keep_the_others_waiting() -> None:
    scouts, inspect = three_scouts()
    gone, *others = scouts

    def leave(now_us: int) -> None:
        if inspect.of("target_started"):
            gone.receive = gone.step = lambda *_: None  # type: ignore[method-assign, assignment]

    with pytest.raises(AssertionError, match="not done"):
        fly_all([gone, *others, inspect], each=leave)
    assert [scout.companion.status.outcome for scout in others] == ["success"] * 2
    assert inspect.companion.status.done
    assert {event.data["system"] for event in inspect.of("failed")} == {gone.px4.system}


def test_a_label_that_the_ugv_sees_otherwise_is_no_success() -> None:
    scout, inspect = pair()
    inspect.labels = {"weed": "disease", "disease": "disease"}
    fly(scout, inspect)
    reports = {event.data["result"]: event.data["label"] for event in scout.of("report_received")}
    assert reports == {"wrong_label": "disease", "confirmed": "disease"}
    assert scout.companion.status.outcome.endswith("wrong label")


def test_the_same_run_twice_is_the_same() -> None:
    runs = []
    for _ in range(2):
        scout, inspect = pair()
        signs = itertools.cycle(THIRTY_PERCENT)
        seconds = fly(scout, inspect, lambda now_us, signs=signs: next(signs) == "x")  # type: ignore[misc]
        runs.append((seconds, scout.events, inspect.events))
    assert runs[0] == runs[1]


def test_a_picture_goes_through_the_real_detector() -> None:
    from sitl_emu.missions.registry import make_companion

    inspect = make_companion("agriculture-inspect", {})
    assert inspect.detect(np.zeros((480, 640, 3), np.uint8), 0.01) == []
