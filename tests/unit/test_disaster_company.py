"""Figures of several aircraft by the truth."""

import math

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.missions.disaster.company import coverage_s, separation_m, served_twice
from sitl_emu.missions.scoring import Track


def track(*rows: tuple[float, float, float, float]) -> Track:
    return Track(*(list(column) for column in zip(*rows, strict=True)))


def test_the_least_distance_is_of_one_moment_and_of_all_pairs() -> None:
    crosses = track((0.0, 0.0, 0.0, 20.0), (0.1, 10.0, 0.0, 20.0))
    before = track((0.0, 10.0, 0.0, 20.0), (0.1, 20.0, 0.0, 20.0))
    above = track((0.1, 10.0, 0.0, 26.0))
    assert separation_m({"one": crosses, "other": before}) == 10.0, "not where it was a while ago"
    assert separation_m({"one": crosses, "other": before, "third": above}) == 6.0
    assert separation_m({"one": crosses}) is None and separation_m({}) is None


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=1, max_size=9))
def test_it_is_what_one_by_one_gives(places: list[tuple[float, float]]) -> None:
    one = track(*((0.1 * number, north, 0.0, 5.0) for number, (north, _) in enumerate(places)))
    other = track(*((0.1 * number, north, 3.0, 5.0) for number, (_, north) in enumerate(places)))
    assert separation_m({"a": one, "b": other}) == min(math.hypot(a - b, 3.0) for a, b in places)


def test_only_the_second_parcel_of_a_target_is_one_too_many() -> None:
    assert (served_twice([]), served_twice([0, 1, None, None]), served_twice([0, 1, 0, 0])) == (0, 0, 2)


def test_coverage_lasts_from_the_first_arming_to_the_last_line() -> None:
    lines = [{"event": event, "time_s": time_s} for event, time_s in
             (("armed", 6.0), ("armed", 5.0), ("line_scanned", 40.0), ("line_scanned", 31.0))]  # fmt: skip
    assert coverage_s(lines) == 35.0 and coverage_s(lines[:2]) is None
