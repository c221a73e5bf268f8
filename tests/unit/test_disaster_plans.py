"""What of the disaster mission's options follows the world."""

from pathlib import Path

import pytest

from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.disaster.mission import _prepare
from sitl_emu.missions.disaster.plans import briefed, in_degrees
from sitl_emu.missions.disaster.settings import settings_of
from sitl_emu.missions.mission import Setting


def setting(world: str) -> Setting:
    return Setting("uas", None, world, (47.0, 8.0, 400.0), [(0.0, 0.0), (0.0, 50.0), (50.0, 0.0)], Path())


def test_what_is_looked_for_is_what_has_happened_unless_a_selection_says_otherwise() -> None:
    assert briefed({}, setting("urban_flood")) == {"selection": {"water_body": 1.0}}
    assert briefed({}, setting("wildfire_perimeter")) == {"selection": {"fire_region": 1.0}}
    mine = {"selection": {"debris_field": 0.8}}
    assert briefed(mine, setting("urban_flood")) == mine
    assert briefed({}, setting("my_world.yaml")) == {}


def test_several_are_told_of_each_other_and_have_one_key_of_the_seed(tmp_path: Path) -> None:
    alone = setting("urban_flood")._replace(calibration=tmp_path / "camera.yaml", seed=7, systems=[3])
    assert not {"members", "swarm_seed", "datum_amsl_m"} & set(_prepare({}, alone))
    together = _prepare({}, alone._replace(systems=[3, 4]))
    assert (together["members"], together["swarm_seed"], together["datum_amsl_m"]) == ("3 4", 7, 400.0)
    assert _prepare({"members": "alone"}, alone._replace(systems=[3, 4]))["members"] == "alone"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"members": "1"}, "option members: '1'; allowed: the MAVLink systems of all, 2 to 16, such as '1 2 3'"),
        ({"members": "1 x"}, "option members: '1 x'; allowed"),
        ({"members": "1 2"}, "option datum_amsl_m: nan; allowed: a number"),
        ({"members": "1 2", "datum_amsl_m": 400.0}, "option swarm_key: missing"),
        ({"members": "1 2", "datum_amsl_m": 400.0, "swarm_seed": 1, "altitude": "terrain"}, "keep apart by height"),
    ],
)
def test_wrong_options_of_several_are_told(options: dict[str, object], said: str) -> None:
    area = in_degrees({"area": "world"}, setting("flat"))["area"]
    with pytest.raises(ValueError, match=said):
        settings_of(Options({"area": area, "detector": "colour", **options}))


def test_an_area_follows_the_world_and_comes_in_degrees() -> None:
    north, east = in_degrees({"area": "world"}, setting("flat"))["area"]["corners"][1]
    assert north == pytest.approx(47.0) and east == pytest.approx(8.0 + 50.0 / 75_900.0, abs=1e-5)
    with pytest.raises(ValueError, match="has no outline"):
        in_degrees({"area": "world"}, setting("flat")._replace(outline_m=[]))
