"""The UGV's way through rows: never across the crop, to the lane nearest to its target, turning on the headland."""

import itertools
import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.missions.agriculture import field_map, ways
from sitl_emu.missions.agriculture.field_map import FieldMap, Spot
from sitl_emu.missions.agriculture.row_route import (
    BACKWARD,
    FORWARD,
    RUN_UP_M,
    NoWay,
    Way,
    crosses,
    is_among_rows,
    length_m,
    to_place,
    to_target,
)
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.mission import Setting

ORIGIN = (40.47, -86.99)
MAP: dict[str, Any] = {
    "origin": ORIGIN,
    "outline_m": [[0, 0], [0, 80], [80, 80], [80, 0]],
    "rows_deg": 0,
    "first_row_m": 3.25,
    "row_spacing_m": 0.75,
    "headland_m": 3,
    "margin_m": 3,
}
FIELD = field_map.read(MAP)
START = (1.5, 78.5)
DIRECTIONS = st.sampled_from((FORWARD, BACKWARD))
SPOTS = st.tuples(st.floats(-2.5, 82.5), st.floats(-2.5, 82.5))
TARGETS = st.tuples(st.floats(4.0, 76.0), st.floats(3.3, 76.7))
MARGINS = st.sampled_from((0.0, 1.0, 3.0, 10.0))


def legs(here: Spot, way: Way) -> list[tuple[Spot, Spot]]:
    return list(itertools.pairwise((here, *way.spots)))


def crossed(field: FieldMap, a: Spot, b: Spot) -> list[float]:
    """The rows that a leg crosses within the crop, by their places across."""
    crop, found = field.crop, list[float]()
    rows = round((crop.across1_m - crop.across0_m) / field.row_spacing_m) + 1
    for row in range(rows):
        across_m = crop.across0_m + row * field.row_spacing_m
        if (a[1] - across_m) * (b[1] - across_m) < 0.0:
            along_m = a[0] + (b[0] - a[0]) * (across_m - a[1]) / (b[1] - a[1])
            found += [across_m] * (crop.along0_m < along_m < crop.along1_m)
    return found


def in_crop(field: FieldMap, a: Spot, b: Spot) -> bool:
    return is_among_rows(field, a) or is_among_rows(field, b) or crosses(field.crop, a, b)


@settings(deadline=None, max_examples=300)
@given(
    here=SPOTS, facing=DIRECTIONS, target=TARGETS, side=st.sampled_from((0, FORWARD, BACKWARD)),
    short_m=st.floats(0.0, 2.0), margin_m=MARGINS,
)  # fmt: skip
def test_no_leg_crosses_a_row_and_the_last_ends_in_the_lane_beside_the_target(
    here: Spot, facing: int, target: Spot, side: int, short_m: float, margin_m: float
) -> None:
    field = FIELD._replace(margin_m=margin_m)
    way = to_target(field, here, facing, target, short_m, side)
    assert not [rows for a, b in legs(here, way) if (rows := crossed(field, a, b))]
    end = way.spots[-1]
    assert end[1] == field.lane_m(target[1]) and abs(end[1] - target[1]) <= field.row_spacing_m / 2 + 1e-9
    assert 0.0 <= (target[0] - end[0]) * way.direction <= short_m + 1e-9
    assert way.direction == side or side == 0


@settings(deadline=None, max_examples=300)
@given(here=SPOTS, facing=DIRECTIONS, target=TARGETS, side=st.sampled_from((0, FORWARD, BACKWARD)))
def test_within_the_crop_it_never_turns(here: Spot, facing: int, target: Spot, side: int) -> None:
    """Whatever is driven among plants is driven in the direction that the vehicle faced, or came in with."""
    way = to_target(FIELD, here, facing, target, 0.6, side)
    inside = [(a, b) for a, b in legs(here, way) if in_crop(FIELD, a, b)]
    for (_, before), (after, _) in itertools.pairwise(inside):
        assert before != after or not is_among_rows(FIELD, before)
    if is_among_rows(FIELD, here):
        assert (inside[0][1][0] - here[0]) * facing >= 0.0
    assert (inside[-1][1][0] - inside[-1][0][0]) * way.direction >= -1e-9


@settings(deadline=None, max_examples=300)
@given(here=SPOTS, facing=DIRECTIONS, target=TARGETS, margin_m=MARGINS)
def test_it_turns_into_a_lane_after_a_run_along_the_headland_and_stays_where_it_may_drive(
    here: Spot, facing: int, target: Spot, margin_m: float
) -> None:
    field = FIELD._replace(margin_m=margin_m)
    way = to_target(field, here, facing, target, 0.6)
    if len(way.spots) > 1:
        before, entry = (here, *way.spots)[-3:-1]
        assert abs(before[1] - entry[1]) >= RUN_UP_M - 1e-9
        assert not is_among_rows(field, entry)
    assert all(field.drivable.contains(spot) for spot in way.spots)


@settings(deadline=None, max_examples=200)
@given(here=SPOTS, facing=DIRECTIONS, home=st.sampled_from((START, (-1.0, 40.0), (78.9, 1.0), (40.0, 78.6))))
def test_the_way_home_crosses_no_row_either(here: Spot, facing: int, home: Spot) -> None:
    way = to_place(FIELD, here, facing, home)
    assert way.spots[-1] == home
    assert not [rows for a, b in legs(here, way) if (rows := crossed(FIELD, a, b))]


def test_a_target_ahead_in_the_same_lane_is_driven_to_straight_on() -> None:
    here = (20.0, FIELD.lane_m(40.0))
    assert to_target(FIELD, here, FORWARD, (35.0, 40.0), 0.6) == Way(((34.4, here[1]),), FORWARD)
    assert to_target(FIELD, here, FORWARD, (20.3, 40.0), 0.6) == Way((here,), FORWARD)


def test_a_target_behind_is_driven_round_to() -> None:
    here = (20.0, FIELD.lane_m(40.0))
    way = to_target(FIELD, here, FORWARD, (15.0, 40.0), 0.6)
    assert way.direction == BACKWARD and way.spots[0] == (79.5, here[1])
    assert to_target(FIELD, here, FORWARD, (35.0, 40.0), 0.6, BACKWARD).direction == BACKWARD


def test_from_the_headland_the_end_of_the_lane_is_taken_from_which_the_way_is_shorter() -> None:
    low, high = (to_target(FIELD, START, FORWARD, (along_m, 40.0), 0.6) for along_m in (10.0, 70.0))
    assert (low.direction, high.direction) == (FORWARD, FORWARD)  # 70 m of lane are less than the way round
    assert to_target(FIELD, (78.5, 78.5), FORWARD, (70.0, 40.0), 0.6).direction == BACKWARD


def test_a_way_round_a_field_is_as_long_as_its_legs() -> None:
    assert length_m((0.0, 0.0), ((3.0, 4.0), (3.0, 10.0))) == 11.0


@settings(deadline=None)
@given(heading_deg=st.floats(-360.0, 360.0), north_m=st.floats(-200.0, 200.0), east_m=st.floats(-200.0, 200.0))
def test_a_map_turned_by_any_heading_gives_places_back(heading_deg: float, north_m: float, east_m: float) -> None:
    c, s = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
    corners = [[n * c - e * s, n * s + e * c] for n, e in MAP["outline_m"]]
    field = field_map.read({**MAP, "rows_deg": heading_deg, "outline_m": corners})
    assert field.crop == pytest.approx(FIELD.crop, abs=1e-6)
    spot = field.turned(north_m, east_m)
    assert field.unturned(*spot) == pytest.approx((north_m, east_m), abs=1e-6)
    assert field.spot(*field.place(spot)) == pytest.approx(spot, abs=1e-6)


def test_the_scenarios_maps_agree_with_the_fields_that_the_seeds_grow() -> None:
    """A farmer's map is right in our scenarios; nothing but this test compares it with the plants."""
    import yaml

    from sitl_emu.run.scenario import find
    from sitl_emu.world.kinds.corn_field.field import build

    for name in ("agriculture", "agriculture-three-scouts"):
        scenario = yaml.safe_load(find(name).read_text())
        size_m = tuple(scenario["world"]["options"]["size_m"])
        told = next(each["companion"]["options"]["field_map"] for each in scenario["vehicles"] if each["name"] == "ugv")
        field = build(1, size_m)
        made = field_map.read({**told, "origin": ORIGIN, "outline_m": [list(corner) for corner in field.outline_m]})
        rows = field.row_east_m
        assert (made.crop.across0_m, made.crop.across1_m) == pytest.approx((rows[0], rows[-1]))


def test_waypoints_come_at_the_targets_side_by_the_rows_course() -> None:
    target = FIELD.place((40.0, 30.0))
    way = ways.by_rows(FIELD, FIELD.place(START), (0.7, -0.7), target, 0.6)
    assert way.course == pytest.approx((1.0, 0.0))
    assert FIELD.spot(*way.points[-1]) == pytest.approx((39.4, FIELD.lane_m(30.0)), abs=1e-3)
    assert ways.points_of(way.as_text) == [pytest.approx(point, abs=1e-7) for point in way.points]
    back = ways.by_rows(FIELD, way.points[-1], (1.0, 0.0), target, 0.6, (-1.0, 0.0))
    assert back.course == pytest.approx((-1.0, 0.0))


# The option


def setting(folder: Path, outline_m: tuple[tuple[float, float], ...]) -> Setting:
    world = "corn_field" if outline_m else "flat"
    return Setting("ugv", folder / "camera.yaml", world, (*ORIGIN, 215.0), outline_m, folder)


def test_a_map_without_an_outline_has_that_of_the_world(tmp_path: Path) -> None:
    told = {name: MAP[name] for name in field_map.NUMBERS}
    corners = tuple((float(north), float(east)) for north, east in MAP["outline_m"])
    options = field_map.with_world({"field_map": told, "look_s": 3}, setting(tmp_path, corners))
    assert options["look_s"] == 3
    assert field_map.of(Options({"field_map": options["field_map"]})) == FIELD
    with pytest.raises(ValueError, match="outline_m: missing, and world flat has no field"):
        field_map.with_world({"field_map": told}, setting(tmp_path, ()))
    assert field_map.with_world({"look_s": 3}, setting(tmp_path, ())) == {"look_s": 3}


def test_a_map_may_be_a_json_file(tmp_path: Path) -> None:
    path = tmp_path / "field.json"
    path.write_text(json.dumps(MAP))
    assert field_map.of(Options({"field_map": str(path)})) == FIELD
    assert field_map.of(Options({})) is None
    path.write_text("[1]")
    with pytest.raises(ValueError, match="allowed: a JSON file with a mapping"):
        field_map.of(Options({"field_map": str(path)}))
    with pytest.raises(ValueError, match="can't be read as a JSON file"):
        field_map.of(Options({"field_map": str(tmp_path / "none.json")}))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rows": 3}, "field_map: rows: unknown; allowed: origin, outline_m, rows_deg, first_row_m"),
        ({"row_spacing_m": 0.0}, "row_spacing_m: 0.0; allowed: a number from 0.2 to 5"),
        ({"row_spacing_m": None}, "row_spacing_m: missing; allowed: a number from 0.2 to 5"),
        ({"rows_deg": True}, "rows_deg: True; allowed: a number from -360 to 360"),
        ({"origin": [91.0, 0.0]}, r"origin: \[91.0, 0.0\]; allowed: \[latitude, longitude\] in degrees"),
        ({"origin": None}, r"origin: None; allowed: \[latitude, longitude\] in degrees"),
        ({"outline_m": [[0, 0], [0, 80], [80, 80]]}, "allowed: four corners"),
        ({"outline_m": [[0, 0], [0, 80], [80, 99], [80, 9]]}, "allowed: a rectangle whose sides run along and across"),
        ({"rows_deg": 10.0}, "allowed: a rectangle whose sides run along and across rows of heading 10 deg"),
        ({"headland_m": 40.0}, "headland_m: 40: leaves no room for rows within the outline"),
    ],
)
def test_what_is_wrong_with_a_map_is_named_with_what_is_allowed(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        field_map.of(Options({"field_map": {**MAP, **change}}))


@pytest.mark.parametrize("target", [(90.0, 40.0), (-10.0, 40.0), (40.0, -20.0), (40.0, 200.0)])
@pytest.mark.parametrize("here", [START, (40.0, 40.0)])
def test_a_target_outside_what_may_be_driven_on_is_not_driven_to(here: Spot, target: Spot) -> None:
    with pytest.raises(NoWay, match="outside the map"):
        to_target(FIELD, here, FORWARD, target, 0.6)


def test_a_field_too_narrow_to_turn_in_has_no_way_but_ahead() -> None:
    narrow = field_map.read(MAP | {"outline_m": [[0, 0], [0, 4], [60, 4], [60, 0]], "first_row_m": 1, "margin_m": 0.5})
    with pytest.raises(NoWay, match="no room on the map"):
        to_target(narrow, (30.0, 1.2), FORWARD, (20.0, 1.2), 0.6)
    assert to_target(narrow, (30.0, 1.2), FORWARD, (40.0, 1.2), 0.6).direction == FORWARD
