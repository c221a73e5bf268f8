"""The UGV's queue: what is the same target, whose turn it is, and who is told what."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.gcs.mission import MissionItem
from sitl_emu.missions.agriculture.jobs import Asker, JobQueue, Sight, Wanted, items_of, wanted_of
from sitl_emu.missions.agriculture.report import Result

HOME = (40.47, -86.99)


def wanted(north_m: float, east_m: float, label: str = "weed") -> Wanted:
    lat, lon = from_metres(north_m, east_m, *HOME)
    return Wanted(round(lat * 1e7), round(lon * 1e7), label, 0.875)


def test_jobs_are_served_in_the_order_they_were_asked_for() -> None:
    queue = JobQueue()
    for north_m in (50.0, 10.0, 30.0):
        queue.ask(1, wanted(north_m, 0.0))
    served = []
    while (job := queue.begin()) is not None:
        served.append(job.number)
        queue.finish(Result.CONFIRMED)
    assert served == [1, 2, 3]
    assert queue.current is None and not queue.waiting


def test_a_job_that_comes_during_a_drive_waits_for_its_turn() -> None:
    queue = JobQueue()
    first = queue.ask(1, wanted(0.0, 0.0))
    assert queue.begin() is first
    second = queue.ask(2, wanted(20.0, 0.0))
    assert queue.current is first and queue.waiting == [second]


@pytest.mark.parametrize("when", ["waiting", "at hand", "done"])
def test_the_same_target_of_two_scouts_is_one_job_with_two_askers(when: str) -> None:
    queue = JobQueue()
    here, there = wanted(10.0, 5.0), wanted(11.5, 6.0)
    job = queue.ask(1, here)
    if when != "waiting":
        queue.begin()
    if when == "done":
        queue.finish(Result.NOT_SEEN)
    assert queue.ask(3, there) is job
    assert queue.jobs == [job]
    assert job.askers == [Asker(1, here.x, here.y), Asker(3, there.x, there.y)]
    assert job.result is (Result.NOT_SEEN if when == "done" else None)


def test_another_place_or_another_label_is_another_job() -> None:
    queue = JobQueue()
    numbers = [queue.ask(1, one).number for one in (wanted(0, 0), wanted(2.6, 0), wanted(0, 0, "disease"))]
    assert numbers == [1, 2, 3]


@pytest.mark.parametrize("result", [Result.NOT_REACHED, Result.PILOT_TOOK_OVER, Result.FAILSAFE])
def test_what_could_not_be_done_is_done_again_when_asked_again(result: Result) -> None:
    queue = JobQueue()
    queue.ask(1, wanted(0.0, 0.0))
    queue.begin()
    queue.finish(result)
    assert queue.ask(1, wanted(0.0, 0.0)).number == 2


def test_each_asker_is_told_by_the_place_that_it_asked_for() -> None:
    queue = JobQueue()
    here, there = wanted(10.0, 5.0), wanted(11.0, 5.0)
    job = queue.ask(1, here)
    queue.ask(3, there)
    job.sights += [Sight("disease", 0.7, 1.5), Sight("weed", 0.9, 1.2)]
    reports = [job.report_to(asker, job.found) for asker in job.askers]
    assert [(report.x, report.y) for report in reports] == [(here.x, here.y), (there.x, there.y)]
    assert {(report.result, report.label, report.score) for report in reports} == {(Result.CONFIRMED, "weed", 0.9)}


def test_what_was_found_is_judged_by_the_label_that_was_asked_for() -> None:
    queue = JobQueue()
    job = queue.ask(1, wanted(0.0, 0.0, "weed"))
    found = [job.found]
    job.sights.append(Sight("disease", 0.8, 1.0))
    found.append(job.found)
    assert found == [Result.NOT_SEEN, Result.WRONG_LABEL]
    assert job.report_to(job.askers[0], job.found).label == "disease"
    assert queue.ask(1, wanted(30.0, 0.0, "")).found is Result.NOT_SEEN


def test_a_job_travels_as_a_mission_of_a_waypoint_and_what_is_there() -> None:
    asked = wanted(10.0, 5.0, "disease")
    items = items_of(asked)
    assert [(item.frame, item.command, item.x, item.y) for item in items] == [
        (3, 16, asked.x, asked.y),
        (3, 31005, asked.x, asked.y),
    ]
    assert (items[1].param2, items[1].param3) == (0.875, 1.0)
    assert wanted_of(items) == asked


def test_a_mission_of_a_waypoint_alone_asks_for_anything_that_is_there() -> None:
    place = MissionItem(3, 16, param4=math.nan, x=404_700_000, y=-869_900_000)
    assert wanted_of([place]) == Wanted(404_700_000, -869_900_000, "", 0.0)
    assert wanted_of([place._replace(command=22)]) is None
    assert wanted_of([]) is None
    assert wanted_of([place._replace(x=900_000_001)]) is None
    nonsense = place._replace(command=31005, param2=math.nan, param3=math.nan)
    assert wanted_of([place, nonsense]) == Wanted(404_700_000, -869_900_000, "", 0.0)


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("ask"), st.integers(1, 3), st.integers(0, 4), st.sampled_from(["weed", "disease"])),
        st.tuples(st.just("begin")),
        st.tuples(st.just("finish"), st.sampled_from([Result.CONFIRMED, Result.NOT_SEEN])),
    ),
    max_size=40,
)


@settings(deadline=None)
@given(steps=STEPS)
def test_whatever_is_asked_in_whatever_order_each_target_is_served_once(steps: list[tuple[object, ...]]) -> None:
    queue, asked, served = JobQueue(), set[tuple[object, object]](), list[int]()
    for what, *arguments in steps:
        if what == "ask":
            system, place, label = arguments
            assert isinstance(system, int) and isinstance(place, int) and isinstance(label, str)
            queue.ask(system, wanted(10.0 * place, 0.0, label))
            asked.add((place, label))
        elif what == "begin" and queue.current is None:
            job = queue.begin()
            served += [job.number] if job is not None else []
        elif what == "finish" and queue.current is not None:
            (result,) = arguments
            assert isinstance(result, Result)
            queue.finish(result)
    assert len(queue.jobs) == len(asked)
    assert served == sorted(set(served))
    open_jobs = len(queue.waiting) + (queue.current is not None)
    assert open_jobs + sum(job.result is not None for job in queue.jobs) == len(queue.jobs)
