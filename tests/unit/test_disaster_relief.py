"""The scan's height over the ground: waypoints that a vehicle flies straight to, over ground that is mapped or not."""

import math
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, Sweep, camera_pose, project
from sitl_emu.missions.companion.terrain.features import Feature
from sitl_emu.missions.companion.terrain.soundings import Sounding
from sitl_emu.missions.companion.terrain.terrain_map import Bounds
from sitl_emu.missions.disaster.relief import CARROT_M, CLEARANCE_M, Relief

SCAN_M, SPEED_M_S = 20.0, 5.0
SOUTH, NORTH, WEST, EAST = 0, 100, -12, 12
END: Corner = (95.0, 0.0)


def relief_of(height_m: Callable[[int, int], float], from_m: int = SOUTH, to_m: int = NORTH) -> Relief:
    """With every cell from `from_m` to `to_m` north known within 5 cm."""
    relief = Relief(Bounds(SOUTH, WEST, NORTH, EAST), CameraModel(), SCAN_M, 7.0, placing=True)
    relief.survey.terrain.add(
        Sounding(0, n + 0.5, e + 0.5, height_m(n, e), 0.05, 0.0, 0.0)
        for n in range(from_m, to_m)
        for e in range(WEST, EAST)
    )
    return relief


def flown(relief: Relief, altitude_m: float) -> list[tuple[float, float]]:
    """North and altitude, ten times a second, of a vehicle that flies straight to its waypoint, a new one a second."""
    north_m, way = 5.0, list[tuple[float, float]]()
    for k in range(round(10 * (END[0] - north_m) / SPEED_M_S)):
        if k % 10 == 0:
            to_m, to_altitude_m = relief.waypoint((north_m, 0.0), END, SPEED_M_S, altitude_m)
            left_m = to_m[0] - north_m
            assert abs(to_m[1]) < 1e-9 and 0.0 < left_m <= CARROT_M + 1e-9
            rise = (to_altitude_m - altitude_m) / left_m
        north_m, altitude_m = north_m + SPEED_M_S / 10.0, altitude_m + rise * SPEED_M_S / 10.0
        way.append((north_m, altitude_m))
    return way


@settings(max_examples=15, deadline=None)
@given(hill_m=st.floats(0.5, 1.5), wave_m=st.floats(90.0, 150.0), slope=st.floats(-0.04, 0.04))
def test_over_hills_it_keeps_its_height(hill_m: float, wave_m: float, slope: float) -> None:
    def ground_m(north_m: float) -> float:
        return slope * north_m + hill_m * math.sin(2.0 * math.pi * north_m / wave_m)

    way = flown(relief_of(lambda n, _: ground_m(n + 0.5)), ground_m(5.0) + SCAN_M)
    assert max(abs(up_m - ground_m(north_m) - SCAN_M) for north_m, up_m in way) < 1.2
    assert math.sqrt(sum((up_m - ground_m(north_m) - SCAN_M) ** 2 for north_m, up_m in way) / len(way)) < 0.6


def test_low_ruins_do_not_lift_it_and_a_high_house_does() -> None:
    def height_m(top_m: float) -> Callable[[int, int], float]:
        return lambda n, e: top_m if 50 <= n < 60 and -6 <= e < 6 else 0.0

    low = flown(relief_of(height_m(5.0)), SCAN_M)
    assert all(abs(up_m - SCAN_M) < 0.2 for _, up_m in low)
    high = flown(relief_of(height_m(16.0)), SCAN_M)
    assert all(up_m > 16.0 + CLEARANCE_M - 0.6 for north_m, up_m in high if 50.0 <= north_m <= 60.0)
    assert high[20][1] == pytest.approx(SCAN_M, abs=0.2) and high[-1][1] < 16.0 + CLEARANCE_M - 2.0


@pytest.mark.parametrize(("top_m", "stops"), [(16.0, False), (19.0, True)])
def test_before_a_roof_that_comes_up_too_late_it_stops_and_climbs(top_m: float, stops: bool) -> None:
    """In time it can't climb to its clearance over either, but to more than half of it over the lower one."""
    relief = relief_of(lambda n, e: top_m if 50 <= n < 60 and -6 <= e < 6 else 0.0)
    to_m, altitude_m = relief.waypoint((43.0, 0.0), END, SPEED_M_S, SCAN_M)
    assert (to_m == (43.0, 0.0)) == stops
    assert not stops or altitude_m > top_m + CLEARANCE_M - 0.2
    on_m, rising_m = relief.waypoint((43.0, 0.0), END, 0.0, top_m + CLEARANCE_M)
    assert on_m == (43.0 + CARROT_M, 0.0) and rising_m >= top_m + CLEARANCE_M, "it goes on from there"


@pytest.mark.parametrize(("sigma_m", "follows"), [(2.0, False), (0.05, True)])
def test_cells_that_are_low_by_chance_are_not_the_ground_and_known_ones_are(sigma_m: float, follows: bool) -> None:
    """Three of them lie 3 m under all others, 6 m beside the way."""
    relief = Relief(Bounds(SOUTH, WEST, NORTH, EAST), CameraModel(), SCAN_M, 7.0, placing=True)
    terrain, low_m = relief.survey.terrain, [(n, 6.5) for n in (30.5, 31.5, 32.5)]
    cells_m = [(n + 0.5, e + 0.5) for n in range(SOUTH, NORTH) for e in range(WEST, EAST)]
    terrain.add(Sounding(0, n, e, 4.0, 0.05, 0.0, 0.0) for n, e in cells_m if (n, e) not in low_m)
    terrain.add(Sounding(0, n, e, 1.0, sigma_m, 0.0, 0.0) for n, e in low_m)
    lowest_m = min(up_m for _, up_m in flown(relief, 4.0 + SCAN_M))
    assert (lowest_m < 4.0 + SCAN_M - 0.5) == follows


def test_where_no_ground_is_known_it_keeps_what_it_flew() -> None:
    nothing = relief_of(lambda n, e: 0.0, 0, 0)
    assert nothing.waypoint((5.0, 0.0), END, SPEED_M_S, SCAN_M) == ((5.0 + CARROT_M, 0.0), SCAN_M)
    way = flown(relief_of(lambda n, _: 3.0, to_m=30), 3.0 + SCAN_M)
    assert all(up_m == pytest.approx(3.0 + SCAN_M, abs=0.1) for _, up_m in way)


def test_near_the_end_it_is_sent_to_the_end() -> None:
    relief = relief_of(lambda n, _: 2.0)
    to_m, altitude_m = relief.waypoint((90.0, 0.0), END, 1.0, 21.0)
    assert to_m == END and altitude_m == pytest.approx(22.0, abs=0.05)
    to_m, altitude_m = relief.waypoint(END, END, 0.0, 22.0)
    assert to_m == END and altitude_m == pytest.approx(22.0, abs=0.05)


def test_a_roof_that_is_still_in_sight_stands() -> None:
    """Its corners' heights are taken when it lies behind; a place is chosen before."""
    relief, roof_m = relief_of(lambda n, e: 0.0, to_m=18), 10.0
    corners = [(20.5 + n, -3.5 + e, -roof_m) for n in range(4) for e in range(8)]
    for k in range(16):
        pose = camera_pose((14.0 + 0.4 * k, 0.0, -24.0), quaternion(0.0, 0.0, 0.0), NADIR)
        seen = [(number, project(CameraModel(), pose, place)) for number, place in enumerate(corners)]
        features = [Feature(number, *pixel) for number, pixel in seen if pixel is not None]
        relief.on_features(200_000 * k, Sweep(pose, pose), features, 0.5, 0.5)
    relief.heights_m(10_000_000)
    assert relief.stands is not None and relief.survey.features == 0
    assert relief.stands.tall.sum() >= 0.8 * len(corners)
    assert relief.stands.tall[20:25, 8:17].sum() == relief.stands.tall.sum() == relief.stands.any.sum()
