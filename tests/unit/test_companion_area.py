"""A polygon on the ground: what lies in it, and near it."""

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.missions.companion.area import contains

L_SHAPE = [(0.0, 0.0), (10.0, 0.0), (10.0, 4.0), (4.0, 4.0), (4.0, 10.0), (0.0, 10.0)]
METRES = st.floats(-5.0, 15.0)


@given(north_m=METRES, east_m=METRES)
def test_a_place_lies_in_an_l_shape_as_it_lies_in_one_of_its_two_bars(north_m: float, east_m: float) -> None:
    in_bars = (0.0 < north_m < 10.0 and 0.0 < east_m < 4.0) or (0.0 < north_m < 4.0 and 0.0 < east_m < 10.0)
    on_edge = contains(L_SHAPE, north_m, east_m, 1e-6) and not contains(L_SHAPE, north_m, east_m)
    assert on_edge or contains(L_SHAPE, north_m, east_m) == in_bars or {north_m, east_m} & {0.0, 4.0, 10.0}


def test_a_margin_reaches_beyond_edges_and_corners() -> None:
    assert not contains(L_SHAPE, -0.5, 5.0)
    assert contains(L_SHAPE, -0.5, 5.0, margin_m=1.0)
    assert contains(L_SHAPE, -0.6, -0.6, margin_m=1.0) and not contains(L_SHAPE, -0.8, -0.8, margin_m=1.0)
