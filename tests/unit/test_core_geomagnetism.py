import math

import pytest

from sitl_emu.core.geomagnetism import STEPS, magnetic_field, modelled_field


@pytest.mark.parametrize(
    ("lat", "lon", "declination", "inclination", "gauss"),
    [
        # NOAA's calculator, WMM2025, 2025.0, rounded
        (47.3977, 8.5456, 3.3, 63.6, 0.481),
        (40.47, -86.99, -4.7, 67.5, 0.521),
        (-33.87, 151.21, 12.8, -64.4, 0.571),
        (51.5, 0.0, 0.8, 66.6, 0.488),
    ],
)
def test_field_at_known_places(lat: float, lon: float, declination: float, inclination: float, gauss: float) -> None:
    for field, within in ((modelled_field(lat, lon), 0.25), (magnetic_field(lat, lon), 0.6)):
        assert math.degrees(field.declination_rad) == pytest.approx(declination, abs=within)
        assert math.degrees(field.inclination_rad) == pytest.approx(inclination, abs=within)
        assert field.strength_gauss == pytest.approx(gauss, rel=0.01)


def test_px4s_home_has_the_declination_that_px4_saves() -> None:
    """EKF2_MAG_DECL of a PX4 v1.18 at its simulator's home."""
    field = magnetic_field(47.397742, 8.545594)
    assert math.degrees(field.declination_rad) == pytest.approx(3.405605, abs=1e-5)


def test_on_the_grid_it_is_the_model_rounded_to_the_tables_steps() -> None:
    model, told = modelled_field(40.0, 10.0), magnetic_field(40.0, 10.0)
    assert told == pytest.approx(model, abs=STEPS[0])
    assert told.declination_rad / STEPS[0] == pytest.approx(629.0)


def test_poles_are_finite() -> None:
    assert math.isfinite(magnetic_field(90.0, 0.0).declination_rad)
    assert magnetic_field(-90.0, 0.0).inclination_rad < 0.0
