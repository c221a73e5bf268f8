"""The ground side's plane against PX4's projection: how far they lie apart."""

import math

import pytest

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.gcs.geodesy import from_metres, to_metres

LAT_DEG, LON_DEG = 47.397742, 8.545594


def apart_m(distance_m: float) -> float:
    """The largest difference at a distance from the reference, in any direction."""
    projection, worst = MapProjection(LAT_DEG, LON_DEG), 0.0
    for degrees in range(0, 360, 15):
        north, east = (distance_m * side for side in (math.cos(math.radians(degrees)), math.sin(math.radians(degrees))))
        px4 = projection.project(*from_metres(north, east, LAT_DEG, LON_DEG))
        worst = max(worst, math.dist(px4, (north, east)))
    return worst


@pytest.mark.parametrize(("distance_m", "limit_m"), [(100.0, 0.001), (200.0, 0.004), (1000.0, 0.1)])
def test_a_field_is_small_enough_for_a_plane(distance_m: float, limit_m: float) -> None:
    assert apart_m(distance_m) == pytest.approx(limit_m, rel=0.05)


def test_there_and_back() -> None:
    assert to_metres(*from_metres(120.0, -80.0, LAT_DEG, LON_DEG), LAT_DEG, LON_DEG) == pytest.approx((120.0, -80.0))
