import math

import pytest

from sitl_emu.core.geomagnetism import magnetic_field


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
    field = magnetic_field(lat, lon)
    assert math.degrees(field.declination_rad) == pytest.approx(declination, abs=0.3)
    assert math.degrees(field.inclination_rad) == pytest.approx(inclination, abs=0.5)
    assert field.strength_gauss == pytest.approx(gauss, rel=0.01)


def test_poles_are_finite() -> None:
    assert math.isfinite(magnetic_field(90.0, 0.0).declination_rad)
    assert magnetic_field(-90.0, 0.0).inclination_rad < 0.0
