"""An area divided: the lanes cover it wholly, and each is somebody's, whoever is lost."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import LineString, Polygon, union_all

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.swarm.division import Lane, lanes, shares

CORNERS = st.lists(st.tuples(st.floats(0.1, 1.0), st.floats(40.0, 200.0)), min_size=3, max_size=9)
FIELD: list[Corner] = [(0.0, 0.0), (100.0, 0.0), (100.0, 80.0), (0.0, 80.0)]


def star(turns: list[tuple[float, float]]) -> list[Corner]:
    """A polygon with hollows: corners around a middle, each at its angle and distance."""
    whole, at, corners = sum(turn for turn, _ in turns), 0.0, []
    for turn, away_m in turns:
        at += turn / whole * math.tau
        corners.append((away_m * math.cos(at), away_m * math.sin(at)))
    return corners


def swath(lane: Lane, width_m: float) -> Polygon:
    return LineString(lane).buffer(width_m / 2.0 + 1e-6, cap_style="flat")


@given(CORNERS, st.floats(5.0, 40.0), st.floats(-180.0, 360.0))
def test_the_lanes_swaths_cover_every_polygon(turns: list[tuple[float, float]], spacing: float, heading: float) -> None:
    corners = star(turns)
    assume(Polygon(corners).is_valid and Polygon(corners).area > 500.0)
    found = lanes(corners, spacing, heading)
    left = Polygon(corners).difference(union_all([swath(one, spacing) for one in found]))
    assert left.area < 1e-3 * Polygon(corners).area
    for (n1, e1), (n2, e2) in found:
        along = math.degrees(math.atan2(e2 - e1, n2 - n1))
        assert math.isclose(math.cos(math.radians(along - heading)), 1.0, abs_tol=1e-6)


@given(st.integers(0, 60), st.sets(st.integers(1, 8), min_size=1), st.data())
def test_every_lane_is_one_members_whoever_is_lost(count: int, members: set[int], data: st.DataObject) -> None:
    found: list[Lane] = [((0.0, float(n)), (50.0 + n % 7, float(n))) for n in range(count)]
    there = data.draw(st.sets(st.sampled_from(sorted(members)), min_size=1))
    divided = shares(found, members, there)
    assert set(divided) == there
    assert sorted(number for numbers in divided.values() for number in numbers) == list(range(count))
    before = shares(found, members, members)
    assert all(set(before[member]) <= set(divided[member]) for member in there), "nobody loses what it had"


def test_a_field_is_divided_into_equal_neighbouring_parts() -> None:
    found = lanes(FIELD, 10.0)
    assert len(found) == 8 and found[0] == ((0.0, 5.0), (100.0, 5.0))
    assert shares(found, [3, 1], [1, 3]) == {1: [0, 1, 2, 3], 3: [4, 5, 6, 7]}
    assert shares(found, [1, 2, 3, 4], [1, 2, 4]) == {1: [0, 1, 4], 2: [2, 3], 4: [5, 6, 7]}
    assert shares(found, [1, 2], []) == {}


def test_where_a_hollow_parts_a_swath_there_are_two_lanes() -> None:
    horseshoe = [
        (0.0, 0.0),
        (100.0, 0.0),
        (100.0, 20.0),
        (40.0, 20.0),
        (40.0, 10.0),
        (30.0, 10.0),
        (30.0, 20.0),
        (0.0, 20.0),
    ]
    assert lanes(horseshoe, 10.0) == [
        ((0.0, 5.0), (100.0, 5.0)),
        ((0.0, 15.0), (30.0, 15.0)),
        ((40.0, 15.0), (100.0, 15.0)),
    ]


@pytest.mark.parametrize(
    ("corners", "text"),
    [
        ([(0.0, 0.0), (1.0, 1.0)], "2 corners that make no area"),
        ([(0.0, 0.0), (10.0, 10.0), (10.0, 0.0), (0.0, 10.0)], "4 corners that make no area; its edge must not cross"),
        ([(0.0, 0.0), (9000.0, 0.0), (9000.0, 9000.0)], r"1800 lanes, 5 m apart; at most 1024: widen the spacing"),
    ],
)
def test_what_is_no_area_is_told_in_one_line(corners: list[Corner], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        lanes(corners, 5.0)
