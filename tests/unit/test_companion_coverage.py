"""Lawnmower lines: every place of an area is seen, lines stay within it, and the way is no longer than it need be."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.missions.companion.area import Corner, contains
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, camera_pose, in_view
from sitl_emu.missions.companion.coverage import (
    CoverageError,
    Footprint,
    Line,
    footprint,
    lawnmower,
    ordered,
    polygon,
    unseen,
    way_m,
)

SEEN = Footprint(30.0, 22.5)
"""15 m above the ground, 90 degrees across."""
L_SHAPE = [(0.0, 0.0), (120.0, 0.0), (120.0, 50.0), (50.0, 50.0), (50.0, 120.0), (0.0, 120.0)]
TOLERANCE_M = 0.05
"""The short side of a sliver."""

SHARES = st.floats(0.0, 1.0)
STARS = st.lists(st.floats(20.0, 150.0), min_size=3, max_size=9).map(
    lambda radii: [
        (r * math.cos(i * math.tau / len(radii)), r * math.sin(i * math.tau / len(radii))) for i, r in enumerate(radii)
    ]
)
"""Outlines about the origin: most are concave."""
HOLE = [(-5.0, -4.0), (5.0, -4.0), (5.0, 4.0), (-5.0, 4.0)]
"""Lies in every one of them but thin triangles."""


def sees(line: Line, place: Corner, seen: Footprint = SEEN) -> bool:
    (n0, e0), (n1, e1) = line
    length = line.length_m
    dn, de = (n1 - n0) / length, (e1 - e0) / length
    along = (place[0] - n0) * dn + (place[1] - e0) * de
    across = (place[1] - e0) * dn - (place[0] - n0) * de
    ends = seen.along_m / 2.0 + TOLERANCE_M
    return abs(across) <= seen.across_m / 2.0 + TOLERANCE_M and -ends <= along <= length + ends


def on(line: Line, share: float) -> Corner:
    (n0, e0), (n1, e1) = line
    return n0 + share * (n1 - n0), e0 + share * (e1 - e0)


@settings(max_examples=60)
@given(
    corners=STARS,
    holed=st.booleans(),
    overlap=st.floats(0.0, 0.7),
    heading_deg=st.none() | st.floats(0.0, 360.0),
    places=st.lists(st.tuples(st.floats(-150, 150), st.floats(-150, 150)), min_size=20, max_size=60),
)
def test_every_place_is_within_half_a_footprint_of_a_line_and_lines_stay_within(
    corners: list[Corner], holed: bool, overlap: float, heading_deg: float | None, places: list[Corner]
) -> None:
    holed = holed and all(contains(corners, *one) for one in HOLE) and len(corners) > 3
    lines = lawnmower(polygon(corners, [HOLE] if holed else []), SEEN, overlap, heading_deg=heading_deg)
    for place in (*places, *corners):
        if contains(corners, *place, 1e-9) and not (holed and contains(HOLE, *place)):
            assert any(sees(line, place) for line in lines), place
    for line in lines:
        for i in range(11):
            place = on(line, i / 10)
            assert contains(corners, *place, 1e-4)
            assert not holed or not contains(HOLE, *place) or contains_only_by_rounding(place)


def contains_only_by_rounding(place: Corner) -> bool:
    return 5.0 - abs(place[0]) < 1e-4 or 4.0 - abs(place[1]) < 1e-4


@settings(max_examples=40)
@given(corners=STARS, margin_m=st.floats(0.5, 5.0), share=SHARES)
def test_lines_keep_the_margin_and_what_it_puts_out_of_reach_is_told(
    corners: list[Corner], margin_m: float, share: float
) -> None:
    area = polygon(corners)
    lines = lawnmower(area, SEEN, margin_m=margin_m)
    for line in lines:
        n, e = on(line, share)
        assert contains(corners, n, e) and not near_edge(corners, n, e, margin_m - 1e-4)
    allowed = area.buffer(-margin_m, join_style="mitre")
    for part in unseen(area, lines, SEEN):
        assert part.intersection(allowed).area < 1e-3, "only tips that no line may reach"


def test_a_margin_puts_no_corner_out_of_reach_that_is_not_sharp() -> None:
    area = polygon(L_SHAPE, [[(15.0, 15.0), (25.0, 15.0), (25.0, 25.0), (15.0, 25.0)]])
    assert not unseen(area, lawnmower(area, SEEN, 0.25, margin_m=5.0), SEEN)
    spike = polygon([(0.0, 0.0), (200.0, 5.0), (0.0, 20.0)])
    assert sum(part.area for part in unseen(spike, lawnmower(spike, SEEN, margin_m=3.0), SEEN)) > 100.0


def near_edge(corners: list[Corner], n: float, e: float, within_m: float) -> bool:
    around = [(n + within_m * math.cos(a / 8 * math.pi), e + within_m * math.sin(a / 8 * math.pi)) for a in range(16)]
    return not all(contains(corners, *place) for place in around)


def test_a_rectangle_is_flown_there_and_back_along_its_long_side() -> None:
    area = polygon([(0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0)])
    lines = lawnmower(area, SEEN, start_m=(0.0, 0.0))
    assert [place for line in lines for place in line] == [
        pytest.approx(place, abs=1e-6) for place in ((0, 15), (100, 15), (100, 45), (0, 45))
    ]
    assert len(lawnmower(area, SEEN, 0.5)) == 4, "15 m apart, the outermost half of that from the edge"
    across = lawnmower(area, SEEN, heading_deg=90.0)
    assert len(across) == 4 and all(line.length_m == pytest.approx(60.0) for line in across)


def test_a_footprint_is_what_the_camera_sees() -> None:
    camera = CameraModel()
    seen = footprint(camera, 15.0)
    assert seen == (30.0, 22.5)
    pose = camera_pose((0.0, 0.0, -15.0), (1.0, 0.0, 0.0, 0.0), NADIR._replace(down_m=0.0))
    for n, e, shown in ((0.0, 14.9, True), (0.0, 15.1, False), (11.2, 0.0, True), (11.3, 0.0, False)):
        assert in_view(camera, pose, (n, e, 0.0)) is shown


def test_what_lines_leave_where_an_edge_runs_aslant_is_gleaned_by_short_ones() -> None:
    triangle = polygon([(0.0, 0.0), (200.0, 5.0), (0.0, 20.0)])
    long_lines = [line for line in lawnmower(triangle, SEEN) if line.length_m > 50.0]
    assert unseen(triangle, long_lines, SEEN), "the tip"
    assert not unseen(triangle, lawnmower(triangle, SEEN), SEEN)


@given(
    lines=st.lists(
        st.tuples(*[st.tuples(st.floats(-99, 99), st.floats(-99, 99))] * 2).map(lambda pair: Line(*pair)), max_size=8
    )
)
def test_an_order_keeps_every_line_and_no_line_is_better_turned(lines: list[Line]) -> None:
    start = (0.0, 0.0)
    way = ordered(lines, start)
    assert sorted(map(sorted, way)) == sorted(map(sorted, lines))
    for i in range(len(way)):
        turned = [*way[:i], way[i].turned(), *way[i + 1 :]]
        assert way_m(way, start) <= way_m(turned, start) + 1e-5


def test_an_order_is_that_of_a_lawnmower() -> None:
    shuffled = [Line((0.0, e), (50.0, e)) for e in (20.0, 0.0, 30.0, 10.0)]
    assert [line.start_m for line in ordered(shuffled, (0.0, -1.0))] == [(0, 0), (50, 10), (0, 20), (50, 30)]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: polygon([(0, 0), (1, 1)]), "2 corners; a polygon has three or more"),
        (lambda: polygon([(0, 0), (10, 10), (10, 0), (0, 10)]), "must not cross"),
        (lambda: polygon([(0, 0), (5, 0), (10, 0)]), "no extent|must not cross"),
        (lambda: polygon([(0, 0), (math.nan, 0), (10, 5)]), "not finite"),
        (lambda: footprint(CameraModel(), 0.0), "must be above 0"),
        (lambda: lawnmower(polygon(L_SHAPE), SEEN, 1.0), "overlap 1; must be"),
        (lambda: lawnmower(polygon(L_SHAPE), SEEN, margin_m=40.0), "leave something of the area"),
        (lambda: lawnmower(polygon(L_SHAPE), SEEN, margin_m=-1.0), "margin -1 m; must be 0 or more"),
    ],
)  # fmt: skip
def test_what_is_no_area_is_told(make, text: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(CoverageError, match=text):
        make()
