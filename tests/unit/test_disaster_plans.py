"""What of the disaster mission's options follows the world."""

import json
from pathlib import Path

import pytest

from sitl_emu.missions.companion.main import options_of, parse
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


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"margin_m": 60.0}, "option margin_m: 60: leaves nothing of the area; allowed: less than half of its width"),
        ({"area": {"corners": []}}, "option area: 0 corners; allowed: 3 or more"),
        ({"area": {"corners": [[47.0, 8.0], [47.001, 8.0]]}}, "option area: 2 corners; allowed: 3 or more"),
        (
            {"area": {"corners": [[47.0, 8.0], [47.0, 8.03], [47.03, 8.03], [47.03, 8.0]]}},
            r"option area: 33\d\d x 23\d\d m, with what is seen from its edges; allowed: 4000000 m2; divide it",
        ),
    ],
)
def test_an_area_of_which_no_plan_can_be_made_is_told_before_the_flight(options: dict[str, object], said: str) -> None:
    hundred = {"corners": [[47.0, 8.0], [47.0, 8.0013], [47.0009, 8.0013], [47.0009, 8.0]]}
    settings_of(Options({"area": hundred, "detector": "colour"}))
    with pytest.raises(ValueError, match=f"^{said}"):
        settings_of(Options({"area": hundred, "detector": "colour", **options}))


def test_an_area_follows_the_world_and_comes_in_degrees() -> None:
    north, east = in_degrees({"area": "world"}, setting("flat"))["area"]["corners"][1]
    assert north == pytest.approx(47.0) and east == pytest.approx(8.0 + 50.0 / 75_900.0, abs=1e-5)
    with pytest.raises(ValueError, match="has no outline"):
        in_degrees({"area": "world"}, setting("flat")._replace(outline_m=[]))


def test_on_an_aircraft_an_area_is_a_file_on_the_command_line(tmp_path: Path) -> None:
    corners = [[47.0, 8.0], [47.001, 8.0], [47.001, 8.001]]
    file = tmp_path / "area.json"
    file.write_text(json.dumps({"corners": corners}))
    words = ["--mission", "disaster", "--connect", "udpin:127.0.0.1:14540", "--option", f"area={file}"]
    given = options_of(parse([*words, "--option", "parcel=no"]))
    made = settings_of(Options({**given, "detector": "colour"}))
    assert [list(corner) for corner in made.corners_deg] == corners and made.parcel is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "option area: .*: can't be read as a JSON file: .*No such file"),
        ("{", "option area: .*: can't be read as a JSON file"),
        ("[]", "option area: .*; allowed: a JSON file with a mapping"),
        ('{"corner": []}', "option area: .*; allowed: {corners: "),
    ],
)
def test_a_file_that_holds_no_area_is_told(tmp_path: Path, text: str | None, said: str) -> None:
    file = tmp_path / "area.json"
    if text is not None:
        file.write_text(text)
    with pytest.raises(ValueError, match=said):
        settings_of(Options({"area": str(file), "detector": "colour"}))


@pytest.mark.parametrize(("value", "carries"), [("yes", True), (True, True), ("no", False), (False, False)])
def test_yaml_makes_no_of_no(value: object, carries: bool) -> None:
    area = in_degrees({"area": "world"}, setting("flat"))["area"]
    made = settings_of(Options({"area": area, "detector": "colour", "parcel": value}))
    assert (made.parcel is not None) == carries
    with pytest.raises(ValueError, match="option parcel: 'maybe'; allowed: yes, no"):
        settings_of(Options({"area": area, "detector": "colour", "parcel": "maybe"}))
