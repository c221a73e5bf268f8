"""A corn field is whole for every seed and size: counts, sizes, distances, nothing overlapping, all inside."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.world.kinds.corn_field import field as corn_field
from sitl_emu.world.kinds.corn_field.crop import KINDS, grow
from sitl_emu.world.kinds.corn_field.field import HEADLAND_M, CornField, build
from sitl_emu.world.kinds.corn_field.objects import DISTRACTOR_KINDS, GROWS_IN_ROWS, TARGET_KINDS, inside, outline
from sitl_emu.world.kinds.corn_field.painter import Painter


def check(field: CornField) -> None:
    north_m, east_m = field.size_m
    assert {t.kind for t in field.targets} == set(TARGET_KINDS)
    for thing in field.objects:
        across = 2.0 * np.hypot(*(outline(thing) - (thing.north_m, thing.east_m)).T)
        assert across.min() >= 0.5 and across.mean() <= 2.0
        shape = outline(thing)
        assert shape.min() > HEADLAND_M and shape[:, 0].max() < north_m - HEADLAND_M
        assert shape[:, 1].max() < east_m - HEADLAND_M
        for other in field.objects:
            if other is not thing and math.hypot(thing.north_m - other.north_m, thing.east_m - other.east_m) < 4.0:
                assert not inside(other, shape[:, 0], shape[:, 1]).any()
        if thing.kind in GROWS_IN_ROWS:
            assert min(abs(row - thing.east_m) for row in field.row_east_m) < 0.1
    for target in field.targets:
        start = field.ugv_start
        assert math.hypot(target.north_m - start.north_m, target.east_m - start.east_m) >= 40.0
    core = field.terrain.heights_m(*np.meshgrid(np.arange(0, north_m), np.arange(0, east_m), indexing="ij"))
    assert core.max() - core.min() >= 2.0 - 0.05
    slopes = np.hypot(*np.gradient(core))
    assert slopes.max() < 0.35, "too steep to drive"
    for place in (field.uas_home, field.ugv_start):
        assert min(place.north_m, place.east_m, north_m - place.north_m, east_m - place.east_m) < HEADLAND_M


@settings(max_examples=15)
@given(
    seed=st.integers(0, 1 << 30),
    size_m=st.tuples(st.floats(80.0, 160.0), st.floats(80.0, 160.0)),
    targets=st.integers(3, 6),
    distractors=st.integers(15, 24),
)
def test_any_seed_and_size_gives_a_whole_field(
    seed: int, size_m: tuple[float, float], targets: int, distractors: int
) -> None:
    field = build(seed, size_m, targets, distractors)
    assert (len(field.targets), len(field.distractors)) == (targets, distractors)
    check(field)


def test_the_default_field_meets_the_missions_demands() -> None:
    for seed in range(1, 11):
        field = build(seed)
        check(field)
        assert field.size_m == (80.0, 80.0) and len(field.targets) >= 3 and len(field.distractors) >= 15
        assert {d.kind for d in field.distractors} == set(DISTRACTOR_KINDS)


def test_the_smallest_field_can_be_built() -> None:
    check(build(3, (60.0, 60.0), targets=3, distractors=8))


def test_a_seed_is_a_field() -> None:
    one, same, other = build(5), build(5), build(6)
    assert one.objects == same.objects and np.array_equal(one.terrain.grid_m, same.terrain.grid_m)
    assert one.objects != other.objects and not np.array_equal(one.terrain.grid_m, other.terrain.grid_m)
    plants, twins = grow(one), grow(same)
    assert np.array_equal(plants.north_m, twins.north_m) and np.array_equal(plants.variant, twins.variant)


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"size_m": (20.0, 80.0)}, "size_m"),
        ({"targets": 0}, "targets"),
        ({"distractors": 999}, "distractors"),
        ({"growth_stage": 12}, "growth_stage"),
        ({"relief_m": 0.0}, "relief_m"),
        ({"targets": 40, "size_m": (60.0, 60.0)}, "no room"),
    ],
)
def test_what_cannot_be_built_is_named(wrong: dict[str, object], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        build(1, **wrong)  # type: ignore[arg-type]


def test_plants_stand_in_rows_and_weeds_do_not() -> None:
    field = build(4)
    plants = grow(field)
    rows = np.asarray(field.row_east_m)
    corn = plants.kind == KINDS.index("corn")
    off_row = np.abs(plants.east_m[corn, None] - rows[None, :]).min(axis=1)
    assert corn.sum() > 20_000 and np.percentile(off_row, 99) < 0.15
    patch = next(t for t in field.targets if t.kind == "weed")
    weeds = (plants.kind == KINDS.index("weed_broad")) | (plants.kind == KINDS.index("weed_grass"))
    within = weeds & inside(patch, plants.north_m, plants.east_m)
    spread = np.abs(plants.east_m[within, None] - rows[None, :]).min(axis=1)
    assert within.sum() >= 8 and np.percentile(spread, 75) > 0.2


def test_no_colour_belongs_to_one_class() -> None:
    """Hues within targets are met in corn and distractors as well: colour alone can't tell them."""
    import cv2

    target, other = np.zeros(180), np.zeros(180)
    for seed in (11, 12):
        field = build(seed)
        painter = Painter(field, 0.05)
        for thing in field.objects:
            reach = 1.2 * thing.radius_m
            pixels = int(2 * reach / 0.05)
            layers = painter.paint(thing.north_m - reach, thing.east_m - reach, pixels, pixels)
            hue, saturation, _ = cv2.split(cv2.cvtColor(layers.canopy[..., :3].copy(), cv2.COLOR_BGR2HSV))
            counts = np.bincount(hue[saturation > 40].ravel(), minlength=180)[:180]
            if thing.is_target:
                target += counts
            else:
                other += counts
    common = target > 0.005 * target.sum()
    assert (other[common] > 0).all()
    assert np.minimum(target / target.sum(), other / other.sum()).sum() > 0.4


def test_building_is_quick() -> None:
    import time

    start = time.thread_time()
    corn_field.build(21)
    assert time.thread_time() - start < 1.0
