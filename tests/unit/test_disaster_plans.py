"""What of the disaster mission's options follows the world."""

from pathlib import Path

import pytest

from sitl_emu.missions.disaster.plans import briefed, in_degrees
from sitl_emu.missions.mission import Setting


def setting(world: str) -> Setting:
    return Setting("uas", None, world, (47.0, 8.0, 400.0), [(0.0, 0.0), (0.0, 50.0), (50.0, 0.0)], Path())


def test_what_is_looked_for_is_what_has_happened_unless_a_selection_says_otherwise() -> None:
    assert briefed({}, setting("urban_flood")) == {"selection": {"water_body": 1.0}}
    assert briefed({}, setting("wildfire_perimeter")) == {"selection": {"fire_region": 1.0}}
    mine = {"selection": {"debris_field": 0.8}}
    assert briefed(mine, setting("urban_flood")) == mine
    assert briefed({}, setting("my_world.yaml")) == {}


def test_an_area_follows_the_world_and_comes_in_degrees() -> None:
    north, east = in_degrees({"area": "world"}, setting("flat"))["area"]["corners"][1]
    assert north == pytest.approx(47.0) and east == pytest.approx(8.0 + 50.0 / 75_900.0, abs=1e-5)
    with pytest.raises(ValueError, match="has no outline"):
        in_degrees({"area": "world"}, setting("flat")._replace(outline_m=[]))
