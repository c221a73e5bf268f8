"""What detections alone would have called a vehicle to: after one frame, and after three in a row."""

import math

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.missions.disaster.alarms import FRAMES, SAME_M, Alarm, Alarms
from tests.unit.disaster_boxes import CAMERA, POND, Box, box_of, pose_at

MIDDLE = (15.0, 14.0)
SHED: Box = (-5.0, 10.0, -2.0, 13.0)
EVERY_US = 200_000


def told(seen: list[bool], score: float = 0.8, within: bool = True) -> list[Alarm]:
    """Frames from above a pond, which show it or nothing."""
    alarms, pose = Alarms(CAMERA, 0.3, lambda north, east: within), pose_at(*MIDDLE)
    for number, there in enumerate(seen):
        time_us = number * EVERY_US
        alarms.update(time_us, time_us, pose, box_of(pose, POND, score=score) if there else [])
    return alarms.all


@given(st.lists(st.booleans(), max_size=12))
def test_one_frame_calls_at_once_and_three_when_they_are_in_a_row(seen: list[bool]) -> None:
    found = {one.frames: one for one in told(seen)}
    first = seen.index(True) if True in seen else None
    third = next((at for at in range(2, len(seen)) if all(seen[at - 2 : at + 1])), None)
    for frames, at in ((1, first), (3, third)):
        assert (frames in found) == (at is not None)
        if at is not None:
            assert found[frames].time_us == at * EVERY_US and found[frames].label == "water_body"
            assert math.dist(found[frames].place_m, MIDDLE) < 0.3


def test_each_thing_calls_once() -> None:
    assert sorted(one.frames for one in told([True] * 10)) == sorted(FRAMES)


def test_weak_detections_and_what_lies_beyond_the_area_call_nobody() -> None:
    assert told([True] * 5, score=0.29) == []
    assert told([True] * 5, within=False) == []


def test_two_things_are_two_where_they_lie_apart() -> None:
    alarms, pose = Alarms(CAMERA, 0.3, lambda north, east: True), pose_at(5.0, 12.0)
    alarms.update(0, 0, pose, [*box_of(pose, POND), *box_of(pose, SHED)])
    (one, other) = alarms.all
    assert math.dist(one.place_m, other.place_m) > SAME_M
