"""An area divided: each scan line is somebody's, whoever is lost."""

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.missions.companion.coverage import Footprint, Line, lawnmower, polygon
from sitl_emu.missions.companion.swarm.division import shares


@given(st.integers(0, 60), st.sets(st.integers(1, 8), min_size=1), st.data())
def test_every_line_is_one_members_whoever_is_lost(count: int, members: set[int], data: st.DataObject) -> None:
    lines = [Line((0.0, float(n)), (50.0 + n % 7, float(n))) for n in range(count)]
    there = data.draw(st.sets(st.sampled_from(sorted(members)), min_size=1))
    divided = shares(lines, members, there)
    assert set(divided) == there
    assert sorted(number for numbers in divided.values() for number in numbers) == list(range(count))
    before = shares(lines, members, members)
    assert all(set(before[member]) <= set(divided[member]) for member in there), "nobody loses what it had"


@given(st.lists(st.floats(1.0, 100.0), min_size=1, max_size=40), st.integers(1, 6))
def test_parts_differ_by_no_more_than_the_longest_line(lengths: list[float], count: int) -> None:
    lines = [Line((0.0, 0.0), (length, 0.0)) for length in lengths]
    parts = shares(lines, range(count), range(count))
    total = {member: sum(lengths[number] for number in numbers) for member, numbers in parts.items()}
    assert all(abs(metres - sum(lengths) / count) <= max(lengths) + 1e-6 for metres in total.values())


def test_a_field_is_divided_into_equal_neighbouring_parts() -> None:
    field = polygon([(0.0, 0.0), (100.0, 0.0), (100.0, 80.0), (0.0, 80.0)])
    lines = lawnmower(field, Footprint(10.0, 10.0), heading_deg=0.0)
    assert len(lines) == 8
    assert shares(lines, [3, 1], [1, 3]) == {1: [0, 1, 2, 3], 3: [4, 5, 6, 7]}
    assert shares(lines, [1, 2, 3, 4], [1, 2, 4]) == {1: [0, 1, 4], 2: [2, 3], 4: [5, 6, 7]}
    assert shares(lines, [1, 2], []) == {}
