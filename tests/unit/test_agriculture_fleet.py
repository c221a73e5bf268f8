"""Several scouts share a UGV, several UGVs what a scout finds; and one of them may go."""

import itertools

import pytest

from sitl_emu.missions.agriculture.inspect import Inspect
from sitl_emu.missions.agriculture.scout import Scout
from sitl_emu.missions.companion.camera_model import MAST, NADIR

from .agriculture_vehicles import LOOKS, STANDS, TARGETS, THIRTY_PERCENT, Node, fly_all, plan
from .companion_px4 import FakePx4


def three_scouts() -> tuple[list[Node], Node]:
    """Three scouts that fly the same lines, one after the other by a few metres, and the one UGV they share."""
    scouts = [Node(Scout(plan(), LOOKS), FakePx4(system, 13, 0.0, 4.0 * system, 5.0), NADIR) for system in (1, 3, 4)]
    return scouts, Node(Inspect(STANDS), FakePx4(2, 10, -30.0, 40.0, 2.5), MAST)


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
