"""Scout and inspect fly and drive a whole mission as state machines: on rails, with a detector that knows the truth."""

import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.missions.agriculture import field_map
from sitl_emu.missions.agriculture.inspect import Inspect
from sitl_emu.missions.agriculture.jobs import Wanted, items_of
from sitl_emu.missions.agriculture.row_route import is_among_rows
from sitl_emu.missions.agriculture.scout import Scout
from sitl_emu.missions.companion.camera_model import MAST, NADIR
from sitl_emu.missions.companion.options import Options

from .agriculture_vehicles import HOME, LOOKS, STANDS, TARGETS, THIRTY_PERCENT, US, Node, fly, pair, plan
from .companion_px4 import STEP_US, FakePx4

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


def test_a_target_that_the_ugv_does_not_see_makes_it_turn_and_then_say_so() -> None:
    scout, inspect = pair()
    inspect.blind = True
    fly(scout, inspect)
    assert {event.data["result"] for event in scout.of("report_received")} == {"not_seen"}
    turned = [event for event in inspect.of("phase") if event.data["phase"] == "turning"]
    assert len(turned) == 2 * len(TARGETS)
    assert scout.companion.status.outcome == f"target {scout.companion.jobs[0].target.id}: not seen"
    assert inspect.companion.status.outcome == "job 1: not seen"


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


def test_the_ugv_is_sent_next_to_the_target_that_is_nearest_to_where_it_says_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The second was found before the third, which lies nearer to the first, where the UGV then is."""
    targets = (("weed", 10.0, 6.0), ("disease", 34.0, 6.0), ("weed", 12.0, 24.0))
    monkeypatch.setattr("tests.unit.agriculture_vehicles.TARGETS", targets)
    scout, inspect = pair()
    fly(scout, inspect)
    assert [event.data["label"] for event in scout.of("target_confirmed")] == ["weed", "disease", "weed"]
    places = [
        to_metres(float(event.data["lat_deg"]), float(event.data["lon_deg"]), *HOME[:2])
        for event in scout.of("target_sent")
    ]
    nearest = [min(range(3), key=lambda i: math.dist(targets[i][1:], place)) for place in places]
    assert nearest == [0, 2, 1]


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


def test_what_was_not_seen_is_told_once_though_its_report_comes_twice() -> None:
    scout, inspect = pair()
    inspect.blind = True
    taken = scout.receive
    scout.receive = lambda now_us, frame: [taken(now_us, frame) for _ in range(2)]  # type: ignore[method-assign, assignment]
    fly(scout, inspect)
    assert [event.data["result"] for event in scout.of("report_received")] == ["not_seen"] * len(TARGETS)


@pytest.mark.parametrize("whose", ["scout", "inspect"])
def test_pictures_of_a_size_that_the_camera_is_not_calibrated_for_are_told_and_not_looked_at(whose: str) -> None:
    """Where they lie on the ground is not known: targets came to lie anywhere, and the mission was none the wiser."""
    scout, inspect = pair()
    node = {"scout": scout, "inspect": inspect}[whose]
    found, seen = node.companion.on_detections, np.zeros((1080, 1920, 3), np.uint8)

    def looks(now_us: int, frame_time_us: int, detections: object) -> object:
        return found(now_us, frame_time_us, node.companion.detect(seen, 0.01) or detections)

    node.companion.on_detections = looks
    fly(scout, inspect)
    why = "pictures of 1920 x 1080, and the camera is calibrated for 640 x 480: give its own `calibration`"
    assert any(why in event.text for event in node.of("failed"))
    if whose == "scout":
        assert scout.companion.status.outcome == why and not scout.px4.armed and not scout.companion.jobs
    else:
        assert {event.data["result"] for event in scout.of("report_received")} == {"not_reached"}


def test_a_waypoint_of_a_flight_before_does_not_end_the_survey() -> None:
    _, inspect = pair()
    without_return = plan()._replace(mission=plan().mission[:-1])
    scout = Node(Scout(without_return, LOOKS), FakePx4(1, 13, 0.0, 0.0, 5.0), NADIR)
    flown_before = mavlink.MAVLink_mission_item_reached_message(5)
    fly(scout, inspect, each=lambda now_us: scout.px4._told.extend([flown_before] * (now_us == US)))
    assert len(scout.companion.jobs) == len(TARGETS) and scout.companion.status.outcome == "success"


def test_an_autopilot_that_starts_again_before_it_is_armed_is_asked_for_its_home_again() -> None:
    scout, inspect = pair()
    started: list[int] = []
    told = scout.px4.on_time
    scout.px4.ack = lambda command: 0 if command == 176 or started else 1

    def on_time(now_us: int) -> list[Any]:
        if not started and scout.px4.commands and scout.px4.commands[-1][0] == 400:
            started.append(now_us)
        out = told(now_us)
        for msg in out if started else ():
            if msg.get_type() in ("ATTITUDE_QUATERNION", "GLOBAL_POSITION_INT"):
                msg.time_boot_ms -= started[0] // 1000 - 100  # its clock begins anew
        knows_home = not started or now_us > started[0] + 4 * US
        return [msg for msg in out if knows_home or msg.get_type() != "HOME_POSITION"]

    scout.px4.on_time = on_time  # type: ignore[method-assign]
    fly(scout, inspect, each=lambda _: setattr(scout, "blind", True))  # pictures' times are of the clock before
    assert started and scout.companion.status.outcome.startswith("no picture for")  # so it was over the field


def test_a_return_altitude_that_the_autopilot_does_not_take_ends_the_mission_on_the_ground() -> None:
    scout, inspect = pair(return_altitude_m=20.0)
    scout.px4.kept.add("RTL_RETURN_ALT")
    fly(scout, inspect)
    assert scout.companion.status.outcome == "parameter RTL_RETURN_ALT: the autopilot does not take 20"
    assert not scout.px4.commands


def test_a_plan_without_a_waypoint_is_refused(tmp_path: Path) -> None:
    up = {"type": "SimpleItem", "command": 22, "frame": 3, "autoContinue": True, "params": [0, 0, 0, None, 0, 0, 9]}
    mission = {"version": 2, "plannedHomePosition": HOME, "items": [up]}
    path = tmp_path / "up.plan"
    path.write_text(json.dumps({"fileType": "Plan", "version": 1, "mission": mission}))
    with pytest.raises(ValueError, match="no waypoint; allowed: a mission with a Survey"):
        Scout.from_options(Options({"plan": str(path)}))


def test_a_target_outside_the_ugvs_map_is_not_driven_to() -> None:
    _, inspect = pair_among_rows()
    far = from_metres(200.0, 10.0, *HOME[:2])

    for now_us in range(0, 20 * US, STEP_US):
        inspect.step(now_us)
        if now_us == 4 * US:
            inspect.companion._asked(9, items_of(Wanted(round(far[0] * 1e7), round(far[1] * 1e7), "weed", 0.9)))
    assert not inspect.px4.missions.accepted
    assert "job 1: the target lies outside the map" in inspect.of("failed")[0].text


def test_a_scout_without_pictures_comes_home_and_is_no_success() -> None:
    scout, inspect = pair()
    looks, scout.px4.speed_m_s = scout.look, 2.0

    def look(now_us: int) -> None:
        if not scout.companion.jobs:
            looks(now_us)

    scout.look = look  # type: ignore[method-assign]
    fly(scout, inspect)
    assert scout.companion.jobs and not scout.px4.armed
    assert scout.companion.status.outcome == "no picture for 20 s; look after the camera"


def test_a_survey_below_the_height_from_which_pictures_are_looked_at_is_no_success() -> None:
    scout, inspect = pair(scan_altitude_m=30.0)
    fly(scout, inspect)
    assert scout.companion.status.outcome == "no picture from 30 m above home, scan_altitude_m, or higher"


def test_a_ugv_without_pictures_does_not_say_that_there_is_nothing() -> None:
    scout, inspect = pair()
    inspect.look = lambda now_us: None  # type: ignore[method-assign]
    fly(scout, inspect)
    assert "no picture of where the target should be" in inspect.of("failed")[0].text
    assert {event.data["result"] for event in scout.of("report_received")} == {"not_reached"}


def test_a_report_outlives_a_silence_that_the_scout_sits_out() -> None:
    scout, inspect = pair(peer_timeout_s=60.0)

    def lost(now_us: int) -> bool:
        seen = inspect.of("inspected")
        return bool(seen) and now_us < seen[0].time_us + 40 * US

    fly(scout, inspect, lost)
    assert inspect.of("failed")[0].text == "report to system 1: no answer to 40 tries"
    assert [event.data["result"] for event in scout.of("report_received")] == ["confirmed", "confirmed"]
    assert scout.companion.status.outcome == "success"
