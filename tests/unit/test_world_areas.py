"""Polygons, fires that spread, and world files that hold all there is: they come back to the last digit."""

import dataclasses
import math
import tempfile
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sitl_emu.vehicles.record import Limits, Words
from sitl_emu.world import fires, polygons
from sitl_emu.world.description import (
    Box,
    Cylinder,
    Fire,
    Hull,
    Mesh,
    Smoke,
    Waypoint,
    Wind,
    WindChange,
    WorldDescription,
    load,
    save,
)

SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
NOTCHED = ((0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (3.0, 2.0), (0.0, 6.0))
sides = st.floats(0.1, 50.0)
corners = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))


# --- a world file with everything ----------------------------------------------------------------------------------


def values(hint: Any, rule: Any = None) -> st.SearchStrategy[Any]:
    """Any value that a field of this type may hold."""
    if typing.get_origin(hint) is typing.Annotated:
        return values(*typing.get_args(hint)[:2])
    if isinstance(rule, Words):
        return st.sampled_from(rule.allowed)
    if isinstance(hint, types.UnionType):
        return st.none() | values(next(each for each in typing.get_args(hint) if each is not types.NoneType))
    if dataclasses.is_dataclass(hint):
        return records(typing.cast(type[Any], hint))
    if typing.get_origin(hint) is Mapping:
        return st.dictionaries(st.text("abc", min_size=1), values(typing.get_args(hint)[1]), min_size=1, max_size=2)
    if typing.get_origin(hint) is tuple:
        inner = typing.get_args(hint)
        if inner[-1] is Ellipsis:
            return st.lists(values(inner[0], rule), max_size=2).map(tuple)
        return st.tuples(*(values(each, rule) for each in inner))
    limits = rule if isinstance(rule, Limits) else Limits(-1e9, 1e9)
    low, high = max(limits.minimum, -1e9), min(limits.maximum, 1e9)
    if hint is float:
        return st.floats(low, high)
    if hint is int:
        return st.integers(math.ceil(low), math.floor(high))
    return st.booleans() if hint is bool else st.text("abc ä:#'0", max_size=5)


def records(record: type[Any]) -> st.SearchStrategy[Any]:
    """Any record; what checks ask beyond single fields is seen to."""
    hints = typing.get_type_hints(record, include_extras=True)
    given_by = {field.name: values(hints[field.name]) for field in dataclasses.fields(record)}
    given_by |= {name: st.none() for name in ("box", "cylinder", "hull", "mesh") if name in given_by}
    if "mass_kg" in given_by or record.__name__ == "Solid":
        shape = st.sampled_from((Box, Cylinder, Hull, Mesh)).flatmap(records)
        return st.builds(
            lambda solid, shape: dataclasses.replace(solid, **{type(shape).__name__.lower(): shape}),
            st.builds(record, **given_by), shape,
        )  # fmt: skip
    triangles = st.builds(
        lambda at, north, east: (at, (at[0] + north, at[1]), (at[0] + north, at[1] + east)), corners, sides, sides
    )
    if "polygon_m" in given_by:
        given_by["polygon_m"] = triangles
    if "area_m" in given_by:
        given_by["area_m"] = st.just(()) | triangles
    if "points_m" in given_by:
        given_by["points_m"] = st.builds(
            lambda n, e, u: ((0.0, 0.0, 0.0), (n, 0.0, 0.0), (0.0, e, 0.0), (0.0, 0.0, u)), sides, sides, sides
        )
    if "base_m" in given_by:
        given_by |= {"base_m": st.floats(0.0, 5.0), "height_m": st.floats(5.1, 100.0)}
    if "path" in given_by:
        given_by["path"] = st.lists(records(Waypoint), max_size=1).map(tuple)
    return st.builds(record, **given_by)


def named_apart(described: WorldDescription) -> WorldDescription:
    """With names that no two share."""
    renamed: dict[str, Any] = {}
    for field in ("solids", "loose", "water", "fires", "cover"):
        all_of = getattr(described, field)
        renamed[field] = tuple(dataclasses.replace(each, name=f"{field} {at}") for at, each in enumerate(all_of))
    return dataclasses.replace(described, **renamed)


@settings(max_examples=60, deadline=None)
@given(records(WorldDescription).map(named_apart))
def test_every_world_comes_back_from_its_file(described: WorldDescription) -> None:
    with tempfile.TemporaryDirectory() as folder:
        save(described, Path(folder, "world.yaml"))
        assert load(Path(folder, "world.yaml")) == described


# --- polygons ------------------------------------------------------------------------------------------------------


def test_a_notch_is_outside() -> None:
    north, east = np.array([1.0, 3.0, 3.0, 5.0, -1.0, 7.0]), np.array([4.0, 4.0, 1.0, 4.0, 1.0, 1.0])
    assert polygons.inside(NOTCHED, north, east).tolist() == [True, False, True, True, False, False]
    assert polygons.is_simple(NOTCHED) and not polygons.is_convex(NOTCHED) and polygons.is_convex(SQUARE)
    assert not polygons.is_simple((SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]))
    assert not polygons.is_simple(SQUARE[:2]) and not polygons.is_simple(((0.0, 0.0), (1.0, 1.0), (2.0, 2.0)))


@given(st.lists(corners, min_size=3), corners)
@example([(0.0, 0.0), (0.0, 0.0), (5e-324, 1.0)], (0.0, 0.0))
def test_one_point_is_asked_for_as_many_are(polygon: list[tuple[float, float]], point: tuple[float, float]) -> None:
    many = polygons.inside(polygon, np.array([point[0]]), np.array([point[1]]))
    assert bool(many[0]) == polygons.contains(polygon, *point)


# --- fires ---------------------------------------------------------------------------------------------------------


def test_a_front_moves_with_the_wind_and_leaves_what_has_burnt() -> None:
    fire = Fire("a", SQUARE, spread_m_s=0.5, burns_s=10.0)
    wind = Wind(north_m_s=3.0)
    assert fires.reached(fire, wind, 0.0) == SQUARE and fires.burnt(fire, wind, 5.0) == ()
    assert max(north for north, _ in fires.reached(fire, wind, 20.0)) == 14.0
    assert max(north for north, _ in fires.burnt(fire, wind, 20.0)) == 9.0
    along = np.array([-1.0, 2.0, 8.0, 10.0, 13.0, 15.0])
    assert fires.burns(fire, wind, 20.0, along, np.full(6, 2.0)).tolist() == [False, False, False, True, True, False]


def test_a_fire_that_does_not_spread_or_has_no_wind_stays() -> None:
    assert fires.reached(Fire("a", SQUARE), Wind(north_m_s=3.0), 100.0) == SQUARE
    assert fires.reached(Fire("a", SQUARE, spread_m_s=1.0), Wind(), 100.0) == SQUARE
    assert fires.burnt(Fire("a", SQUARE), Wind(), 1e6) == (), "it burns without end"


@given(st.floats(0.0, 500.0), st.floats(0.0, 100.0), st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_what_has_been_reached_stays_reached(time_s: float, later_s: float, north_m_s: float, east_m_s: float) -> None:
    fire, wind = Fire("a", SQUARE, spread_m_s=0.3), Wind(north_m_s, east_m_s)
    one, other = (abs(polygons.area_m2(fires.reached(fire, wind, at))) for at in (time_s, time_s + later_s))
    assert other >= one - 1e-6


def test_smoke_drifts_with_the_wind_of_the_moment_and_thins_out() -> None:
    smoke = Smoke(height_m=30.0, density_1_m=0.2, rise_m_s=2.0)
    fire, wind = Fire("a", SQUARE, smoke=smoke), Wind(east_m_s=4.0, changes=(WindChange(10.0, 0.0, 0.0),))
    assert fires.plume(fire, wind, 0.0, 0.0) == (0.0, 0.0, 0.0, 0.2)
    assert fires.plume(fire, wind, 0.0, 20.0)[:3] == pytest.approx((0.0, 40.0, 2.4))
    assert 0.0 < fires.plume(fire, wind, 0.0, 20.0).extinction_1_m < 0.1
    assert fires.plume(fire, wind, 5.0, 20.0).east_m == pytest.approx(20.0), "half of the wind is left"
    assert fires.plume(fire, wind, 0.0, 31.0).extinction_1_m == 0.0
    with pytest.raises(ValueError, match="a has no smoke"):
        fires.plume(Fire("a", SQUARE), wind, 0.0, 1.0)
