"""A whole flight of the disaster mission over ground that is not level, mapped before: how high it flies, and looks."""

import math
from collections.abc import Callable

import pytest
from shapely import Polygon, box

from sitl_emu.missions.companion.terrain.soundings import Sounding
from sitl_emu.missions.disaster.relief import CLEARANCE_M
from tests.unit.disaster_sky import CAMERA, Sky

SCAN_M = 15.0
STRIP_M = [(0.0, 0.0), (0.0, 140.0), (12.0, 140.0), (12.0, 0.0)]


def sky_over(ground_m: Callable[[float, float], float], ponds: list[Polygon]) -> Sky:
    sky = Sky(1, STRIP_M, ponds, 0.0, 1)
    sky.ground_m = ground_m
    flight = sky.companions[1].flight
    flight.settings = flight.settings._replace(altitude="terrain")
    assert sky.fly(60.0, then=lambda sky: sky.tells(1, "phase", phase="taking off"))
    flight.ground.survey.terrain.add(
        Sounding(0, n + 0.5, e + 0.5, ground_m(n + 0.5, e + 0.5), 0.05, 0.0, 0.0)
        for n in range(-10, 22)
        for e in range(-10, 150)
    )
    return sky


def slope_m(north_m: float, east_m: float) -> float:
    """A hill of 18 m, no steeper than what is taken for ground."""
    return min(max(0.14 * east_m, 0.0), 18.0)


def over_ground_m(sky: Sky) -> float:
    north_m, east_m, up_m = sky.quads[1].true_m
    return up_m - sky.ground_m(north_m, east_m)


def test_ground_below_home_is_looked_at_from_the_scans_height() -> None:
    sky = sky_over(lambda north_m, east_m: -0.14 * min(max(east_m, 0.0), 72.0), [])
    companion = sky.companions[1]
    assert sky.fly(120.0, then=lambda sky: sky.quads[1].true_m[1] > 90.0)
    assert sky.quads[1].up_m < 6.0 and over_ground_m(sky) == pytest.approx(SCAN_M, abs=1.5)
    gsd_m = companion.wants_frame(sky.now_us // 1000 * 1000)
    assert gsd_m is not None and gsd_m * CAMERA.focal_px == pytest.approx(over_ground_m(sky), abs=1.5)
    assert companion.flight.over_ground_m == pytest.approx(over_ground_m(sky), abs=1.5)


def test_over_a_place_on_a_hill_it_keeps_the_scans_height_and_comes_back_over_the_hill() -> None:
    sky = sky_over(slope_m, [box(4.0, 118.0, 8.0, 122.0)])
    lowest_m, released_m = [math.inf], list[float]()

    def flies(sky: Sky) -> bool:
        up = sky.tells(1, "phase", phase="scanning")
        home = sky.tells(1, "phase", phase="returning")
        if up and not home:
            lowest_m.append(over_ground_m(sky))
        if sky.parcels and not released_m:
            released_m.append(over_ground_m(sky))
        return False

    assert sky.fly(400.0, then=flies)
    assert released_m == [pytest.approx(10.0, abs=1.0)], sky.flown().aborts
    assert min(lowest_m) == pytest.approx(released_m[0], abs=0.7), "lower than there it never was"
    told = next(event for _, _, event in sky.events if event.kind == "target_confirmed")
    assert told.data["sigma_m"] < 1.0
    assert sky.quads[1].parameters["RTL_RETURN_ALT"] >= 18.0 + CLEARANCE_M - 1.0
    assert sky.flown().outcomes == {1: "success"}
