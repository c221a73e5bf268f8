"""A pilot takes the vehicle of the disaster mission over for minutes, and gives it back somewhere else, or lands it."""

import pytest
from shapely import Point, box

from tests.unit.companion_px4 import HOLD, POSITION
from tests.unit.disaster_sky import Sky

AREA_M = [(0.0, 0.0), (0.0, 60.0), (40.0, 60.0), (40.0, 0.0)]
FIRE = box(24.0, 15.0, 40.0, 45.0)


def has_for(sky: Sky, seconds: float, moves_m: float) -> None:
    """A pilot has it for longer than any limit of what it was about, and leaves it so far to the east."""
    quad = sky.quads[1]
    quad.choose(POSITION)
    until_us = sky.now_us + round(seconds * 1e6)
    assert sky.fly(1000.0, then=lambda sky: sky.now_us >= until_us)
    assert sky.tells(1, "yielded")
    quad.east_m += moves_m
    quad.choose(HOLD)


def test_given_back_on_its_way_along_a_line_it_flies_on_to_the_lines_end() -> None:
    sky = Sky(1, AREA_M, [], 0.0, 1)
    assert sky.fly(120.0, then=lambda sky: sky.quads[1].true_m[1] > 10.0)
    has_for(sky, 190.0, -5.0)
    assert sky.fly(500.0)
    assert sky.tells(1, "resumed") and sky.flown().outcomes == {1: "success"}


@pytest.mark.parametrize("aims", [False, True])
def test_given_back_low_over_a_place_it_gives_that_up_and_comes_again(
    aims: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    sky, asked = Sky(1, AREA_M, [FIRE], 0.0, 1), list[int]()

    def is_sure() -> bool:
        asked.append(sky.now_us)
        return bool(sky.flown().aborts)

    monkeypatch.setattr(sky.companions[1].flight, "_is_sure", is_sure)
    delivers = {"phase": "delivering"}
    low = {False: lambda sky: sky.tells(1, "phase", **delivers) and sky.quads[1].up_m < 14.0, True: lambda _: asked}
    assert sky.fly(300.0, then=low[aims])
    assert bool(asked) == aims
    has_for(sky, 65.0, 8.0)
    assert sky.fly(700.0)
    flown = sky.flown()
    assert flown.aborts == [(1, "vehicle was taken over")] and flown.outcomes == {1: "success"}
    ((_, north_m, east_m),) = flown.parcels
    assert 0.5 < FIRE.distance(Point(north_m, east_m)) < 5.0


def test_taken_over_on_its_way_up_the_mission_ends_when_the_vehicle_is_disarmed() -> None:
    sky = Sky(1, AREA_M, [], 0.0, 1)
    assert sky.fly(60.0, then=lambda sky: sky.quads[1].up_m > 3.0)
    quad = sky.quads[1]
    quad.choose(POSITION)
    assert sky.fly(70.0, then=lambda sky: sky.tells(1, "yielded"))
    quad.up_m, quad.armed = 0.0, False
    assert sky.fly(sky.now_us / 1e6 + 5.0)
    assert sky.flown().outcomes == {1: "pilot took over"}
