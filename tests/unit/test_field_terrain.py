"""A height map answers alike for one point and for many, and is level beyond its edge."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.world.kinds.corn_field.field import build
from sitl_emu.world.terrain import HeightMap

TERRAIN = build(2).terrain
METRES = st.floats(-200.0, 300.0, allow_nan=False)


@given(north=METRES, east=METRES)
def test_scalar_and_array_paths_agree(north: float, east: float) -> None:
    many = TERRAIN.heights_m(np.array([north]), np.array([east]))
    assert TERRAIN.height_m(north, east) == pytest.approx(float(many[0]), abs=1e-9)


def test_bilinear_between_grid_points() -> None:
    terrain = HeightMap(np.array([[0.0, 1.0], [2.0, 7.0]]), 10.0, 20.0, 2.0)
    assert terrain.height_m(10.0, 20.0) == 0.0
    assert terrain.height_m(12.0, 22.0) == pytest.approx(7.0, abs=1e-6)
    assert terrain.height_m(11.0, 21.0) == pytest.approx(2.5)
    assert terrain.height_m(10.0, 21.0) == pytest.approx(0.5)
    assert terrain.height_m(-99.0, 999.0) == pytest.approx(1.0, abs=1e-6)


def test_home_is_the_zero_of_heights() -> None:
    assert TERRAIN.height_m(0.0, 0.0) == pytest.approx(0.0, abs=1e-9)


def test_a_grid_must_be_one() -> None:
    with pytest.raises(ValueError, match="2 x 2"):
        HeightMap(np.zeros((1, 5)), 0.0, 0.0, 1.0)
    with pytest.raises(ValueError, match="positive"):
        HeightMap(np.zeros((3, 5)), 0.0, 0.0, 0.0)
