"""Plans that follow the world: the whole field, or a strip of it for each of several scouts."""

from pathlib import Path

import pytest

from sitl_emu.gcs.geodesy import to_metres
from sitl_emu.gcs.plan_file import read_plan
from sitl_emu.missions.agriculture.plans import written
from sitl_emu.missions.mission import Setting

HOME = (40.47, -86.99, 215.0)
FIELD_M = ((0.0, 0.0), (0.0, 90.0), (60.0, 90.0), (60.0, 0.0))


def setting(folder: Path, outline_m: tuple[tuple[float, float], ...] = FIELD_M) -> Setting:
    return Setting("scout", folder / "camera.yaml", "corn_field" if outline_m else "flat", HOME, outline_m, folder)


def area(plan: str, folder: Path) -> list[tuple[int, int]]:
    """Corners (north, east) of the plan's survey in whole metres of a field of 60 x 90 m."""
    path = folder / "scout.plan"
    assert written({"plan": plan, "other": 1}, setting(folder)) == {"plan": str(path), "other": 1}
    corners = [to_metres(lat, lon, *HOME[:2]) for lat, lon in read_plan(path).area]
    return sorted((round(north), round(east)) for north, east in corners)


def test_the_option_field_becomes_a_plan_of_the_whole_field(tmp_path: Path) -> None:
    assert area("field", tmp_path) == [(0, 0), (0, 90), (60, 0), (60, 90)]


@pytest.mark.parametrize(
    ("strip", "west_m", "east_m"), [("1/3", 0, 30), ("2/3", 30, 60), ("3/3", 60, 90), ("1/1", 0, 90)]
)
def test_a_strip_of_the_field_is_counted_from_the_west(strip: str, west_m: int, east_m: int, tmp_path: Path) -> None:
    assert area(f"field {strip}", tmp_path) == [(0, west_m), (0, east_m), (60, west_m), (60, east_m)]


@pytest.mark.parametrize("strip", ["0/3", "4/3", "1/0"])
def test_a_strip_that_there_is_not_is_named_with_what_is_allowed(strip: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=f"plan: 'field {strip}': allowed: 'field', or a strip of it"):
        area(f"field {strip}", tmp_path)


def test_a_plan_file_of_ones_own_is_left_alone_and_a_world_without_a_field_has_no_plan(tmp_path: Path) -> None:
    flat = setting(tmp_path, ())
    assert written({"plan": "my.plan"}, flat) == {"plan": "my.plan"}
    with pytest.raises(ValueError, match="world flat has no field"):
        written({"plan": "field 1/2"}, flat)
