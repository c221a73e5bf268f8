"""A pilot or a failsafe takes over a vehicle of the agriculture mission: who yields, who is told, how it goes on."""

from collections.abc import Callable

import pytest

from .agriculture_vehicles import US, Node, fly, pair
from .companion_px4 import HOLD, MISSION, POSITION, RETURN


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


def test_a_failsafe_that_ends_the_flight_is_told_although_the_mode_that_is_shown_stays() -> None:
    scout, inspect = pair()

    def falls(now_us: int) -> None:
        if now_us == 15 * US:
            scout.px4.terminate(now_us)
        if now_us == 25 * US:
            scout.px4.armed = False

    fly(scout, inspect, each=falls)
    yielded = scout.of("yielded")
    assert [(event.data["by"], event.data["mode"]) for event in yielded] == [("failsafe", "termination")]
    assert scout.companion.status.outcome == "failsafe (cause unknown)"


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


def entered(node: Node, phase: str) -> int | None:
    """When it came to a phase first."""
    return next((event.time_us for event in node.of("phase") if event.data["phase"] == phase), None)


def has_for(
    node: Node, phase: str, seconds: float, back: tuple[int, int], moves_m: float = 0.0
) -> Callable[[int], None]:
    """A pilot who takes a vehicle half a second into a phase, leaves it somewhere else, and gives it back by a mode."""
    taken: list[int] = []

    def pilot(now_us: int) -> None:
        since_us = entered(node, phase)
        if not taken and since_us is not None and now_us > since_us + US / 2:
            taken.append(now_us)
            node.px4.choose(POSITION)
        if taken and now_us == taken[0] + round(seconds * US):
            assert node.companion.status.phase == "yielded"
            node.px4.north_m += moves_m
            node.px4.choose(back)

    return pilot


def test_a_uas_that_a_pilot_held_on_its_way_home_for_a_while_comes_home() -> None:
    scout, inspect = pair()
    fly(scout, inspect, each=has_for(scout, "returning", 320.0, RETURN), limit_s=800.0)
    assert scout.of("resumed") and not scout.of("failed")
    assert scout.companion.status.outcome == "success"


def test_the_time_to_look_at_a_target_is_the_ugvs_own() -> None:
    scout, inspect = pair()
    inspect.companion.on_detections = lambda *_: []  # it would see at once what it came for
    takes_and_gives_back = has_for(inspect, "inspecting", 10.0, HOLD)

    def pilot(now_us: int) -> None:
        takes_and_gives_back(now_us)
        if inspect.of("resumed"):
            inspect.companion.__dict__.pop("on_detections", None)

    fly(scout, inspect, each=pilot)
    assert not [event for event in inspect.of("phase") if event.data["phase"] == "turning"]
    assert scout.companion.status.outcome == "success"


def test_a_ugv_that_is_given_back_on_its_turn_drives_on() -> None:
    scout, inspect = pair()
    inspect.blind = True
    fly(scout, inspect, each=has_for(inspect, "turning", 250.0, HOLD, moves_m=-10.0), limit_s=1000.0)
    assert inspect.of("resumed") and not inspect.of("failed")
    places = 2 * len([event for event in inspect.of("phase") if event.data["phase"] == "turning"])
    assert [command for command, _ in inspect.px4.commands].count(192) == places + 1


def test_a_uas_that_a_pilot_stops_on_its_way_home_is_left_to_the_pilot() -> None:
    scout, inspect = pair()
    stopped, sent = list[int](), list[int]()

    def pilot(now_us: int) -> None:
        since_us = entered(scout, "returning")
        if since_us is not None and now_us > since_us + US and not stopped:
            stopped.append(now_us)
            sent.append(len(scout.px4.commands))
            scout.px4.choose(HOLD)
        if stopped and now_us == stopped[0] + 40 * US:
            sent.append(len(scout.px4.commands))
            scout.px4.choose(RETURN)

    fly(scout, inspect, each=pilot)
    assert sent[0] == sent[1] and scout.of("yielded")[0].data["mode"] == "hold"
    assert scout.of("resumed") and scout.companion.status.outcome == "success"


def test_a_uas_that_is_armed_when_its_companion_starts_is_left_to_who_flies_it() -> None:
    scout, inspect = pair()
    scout.px4.armed, scout.px4.mode = True, POSITION
    fly(scout, inspect)
    assert scout.companion.status.outcome == "the vehicle is armed already; land and disarm it first"
    assert not scout.px4.commands and not scout.px4.missions.accepted


def test_a_uas_that_a_pilot_flies_while_its_autopilot_gets_ready_is_left_to_the_pilot() -> None:
    scout, inspect = pair()

    def pilot(now_us: int) -> None:
        if now_us == US:
            assert entered(scout, "waiting for health")
            scout.px4.armed, scout.px4.mode = True, POSITION

    fly(scout, inspect, each=pilot)
    assert scout.companion.status.outcome == "the vehicle is armed already; land and disarm it first"
    assert not scout.px4.commands


def test_a_ugv_that_somebody_drives_begins_no_job_until_it_is_disarmed() -> None:
    scout, inspect = pair()
    inspect.px4.armed, inspect.px4.mode = True, POSITION
    asked: list[int] = []

    def driver(now_us: int) -> None:
        if not asked and inspect.of("target_accepted"):
            asked.append(now_us)
        if asked and now_us == asked[0] + 10 * US:
            assert not inspect.px4.commands and not inspect.px4.missions.accepted
            inspect.px4.armed = False

    fly(scout, inspect, each=driver)
    assert (
        asked
        and [event.text for event in inspect.of("text")].count("Somebody drives the vehicle: the target waits") == 1
    )
    assert scout.companion.status.outcome == "success"


@pytest.mark.parametrize("gives_back", [True, False])
def test_a_scout_waits_for_a_ugv_that_a_pilot_has(gives_back: bool) -> None:
    scout, inspect = pair(report_timeout_s=100.0)
    inspect.px4.speed_m_s = 0.5  # the last target is driven to when the scout has landed long since
    taken: list[int] = []

    def pilot(now_us: int) -> None:
        landed, started = entered(scout, "landed"), inspect.of("target_started")
        if not taken and landed and len(started) == 2 and now_us > started[1].time_us + 10 * US:
            taken.append(now_us)
            inspect.px4.choose(POSITION)
        if taken and now_us == taken[0] + 90 * US and gives_back:
            assert [event.data["result"] for event in scout.of("report_received")] == ["confirmed", "pilot_took_over"]
            assert not scout.companion.status.done
            inspect.px4.choose(MISSION)
        if scout.companion.status.done:
            inspect.px4.choose(MISSION)

    fly(scout, inspect, each=pilot, limit_s=1000.0)
    assert taken
    outcome = scout.companion.status.outcome
    assert outcome == ("success" if gives_back else f"target {scout.companion.jobs[1].target.id}: pilot took over")
