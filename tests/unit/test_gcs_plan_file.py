"""QGroundControl's plan files: read as it would upload them, written as it saves them, wrong ones explained."""

import copy
import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.geodesy import distance_m, from_metres
from sitl_emu.gcs.mission import MissionUpload
from sitl_emu.gcs.plan_file import PlanError, read_plan, survey_plan, transects, write_plan

HOME = (40.47, -86.99, 215.0)
CORNERS = [from_metres(n, e, *HOME[:2]) for n, e in ((0, 0), (80, 0), (80, 80), (0, 80))]


def plan() -> dict[str, Any]:
    return survey_plan(HOME, CORNERS, 15.0, 12.0, 5.0, fence=CORNERS, rally=[(40.47, -86.9901, 12.0)])


def read(data: Any, tmp_path: Path) -> Any:
    path = tmp_path / "a.plan"
    path.write_text(data if isinstance(data, str) else json.dumps(data))
    return read_plan(path)


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    write_plan(tmp_path / "a.plan", plan())
    read_back = read_plan(tmp_path / "a.plan")
    commands = [item.command for item in read_back.mission]
    assert commands == [22, 178, 16, 206, *[16] * 13, 206, 20]
    assert all(item.z == 15.0 and item.frame == 3 for item in read_back.mission if item.command in (16, 22))
    assert [item.command for item in read_back.fence] == [5001] * 4
    assert [(item.command, item.z) for item in read_back.rally] == [(5100, 12.0)]
    assert read_back.home == HOME
    assert all(distance_m(*a, *b) < 0.02 for a, b in zip(read_back.area, CORNERS, strict=True))


def test_a_plan_of_qgroundcontrol_is_read(tmp_path: Path) -> None:
    simple = {"autoContinue": True, "type": "SimpleItem", "AMSLAltAboveTerrain": None, "AltitudeMode": 1}
    data = {
        "fileType": "Plan",
        "geoFence": {
            "circles": [{"circle": {"center": [47.4, 8.55], "radius": 55.5}, "inclusion": False, "version": 1}],
            "polygons": [],
            "version": 2,
        },
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": 15,
            "firmwareType": 12,
            "globalPlanAltitudeMode": 1,
            "hoverSpeed": 5,
            "items": [
                {**simple, "command": 22, "doJumpId": 1, "frame": 3, "params": [15, 0, 0, None, 47.397, 8.545, 50]},
                {**simple, "command": 16, "doJumpId": 4, "frame": 3, "params": [0, 0, 0, None, 47.398, 8.546, 50]},
                {**simple, "command": 177, "doJumpId": 5, "frame": 2, "params": [4, 2, 0, 0, 0, 0, 0]},
            ],
            "plannedHomePosition": [47.397, 8.545, 488],
            "vehicleType": 2,
            "version": 2,
        },
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
    read_back = read(data, tmp_path)
    takeoff, waypoint, jump = read_back.mission
    assert (takeoff.x, takeoff.y, takeoff.param1) == (473970000, 85450000, 15)
    assert math.isnan(waypoint.param4)
    assert jump.param1 == 1  # the item that has doJumpId 4
    assert [(item.command, item.param1) for item in read_back.fence] == [(5004, 55.5)]
    assert read_back.area == ()


def circle(radius: float) -> list[Any]:
    return [{"circle": {"center": [47.4, 8.55], "radius": radius}, "inclusion": False, "version": 1}]


WRONG = [
    (("fileType",), "Parameters", 'fileType: "Parameters"; allowed: "Plan"'),
    (("version",), 2, "version: 2; allowed: 1"),
    (("mission", "plannedHomePosition"), [95, 0, 0], "plannedHomePosition[0]: 95; allowed: a latitude, -90 to 90"),
    (("mission", "items", 0, "command"), "takeoff", 'mission.items[0].command: "takeoff"; allowed: a MAV_CMD'),
    (("mission", "items", 0, "params"), [1, 2], "mission.items[0].params: [1, 2]; allowed: seven numbers or null"),
    (("mission", "items", 0, "params", 4), 123.0, "mission.items[0].params[4:6][0]: 123.0; allowed: a latitude"),
    (("mission", "items", 0, "frame"), 10, "mission.items[0].frame: 10; allowed: a MAV_FRAME of 0, 1, 2, 3, 5, 6"),
    (("mission", "items", 1, "type"), "Simple", 'items[1].type: "Simple"; allowed: SimpleItem, ComplexItem'),
    (("mission", "items", 2, "complexItemType"), "StructureScan", "allowed: survey, CorridorScan"),
    (("geoFence", "polygons", 0, "polygon"), [[1, 2], [3, 4]], "allowed: three corners or more"),
    (("geoFence", "polygons", 0, "inclusion"), "yes", 'polygons[0].inclusion: "yes"; allowed: true, false'),
    (
        ("mission", "items", 0, "params", 1),
        1e300,
        "items[0].params[1]: 1e+300; allowed: a number or null, within ±3.4e38",
    ),
    (
        ("mission", "items", 0, "params", 6),
        -math.inf,
        "items[0].params[6]: -Infinity; allowed: a number or null, within",
    ),
    (("mission", "items", 0, "params", 6), 10**399, "items[0].params[6]: 1000"),
    (("mission", "items", 0, "params", 5), 10**399, "items[0].params[5]: 1000"),
    (("mission", "items", 1, "params", 4), 2**31, "items[1].params[4]: 2147483648; allowed: -2147483648 to 2147483647"),
    (("mission", "items", 1, "params", 5), -3e9, "items[1].params[5]: -3000000000; allowed: -2147483648 to 2147483647"),
    (("mission", "items", 0, "doJumpId"), [1], "mission.items[0].doJumpId: [1]; allowed: a number"),
    (("mission", "plannedHomePosition", 2), 10**399, "mission.plannedHomePosition[2]: 1000"),
    (
        ("geoFence", "circles"),
        circle(math.inf),
        "circles[0].circle.radius: Infinity; allowed: a radius in m above 0, wit",
    ),
    (
        ("geoFence", "circles"),
        circle(1e300),
        "circles[0].circle.radius: 1e+300; allowed: a radius in m above 0, within",
    ),
    (("geoFence", "circles"), circle(10**399), "geoFence.circles[0].circle.radius: 1000"),
    (("geoFence", "circles"), circle(math.nan), "circles[0].circle.radius: NaN; allowed: a radius in m above 0"),
    (
        ("geoFence", "polygons", 0, "polygon"),
        [[1, 2]] * 65536,
        "geoFence: 65536 items to upload; allowed: at most 65535",
    ),
    (
        ("rallyPoints", "points", 0, 2),
        1e300,
        "rallyPoints.points[0][2]: 1e+300; allowed: an altitude above home in m, wi",
    ),
    (("rallyPoints", "points", 0), [1, 2], "rallyPoints.points[0]: [1, 2]; allowed: [latitude, longitude, altitude]"),
]


@pytest.mark.parametrize(("field", "value", "message"), WRONG, ids=[".".join(map(str, w[0])) for w in WRONG])
def test_a_wrong_field_is_told_with_file_field_value_and_what_is_allowed(
    field: tuple[Any, ...], value: Any, message: str, tmp_path: Path
) -> None:
    data = copy.deepcopy(plan())
    part: Any = data
    for name in field[:-1]:
        part = part[name]
    part[field[-1]] = value
    with pytest.raises(PlanError) as error:
        read(data, tmp_path)
    assert message in str(error.value)
    assert str(error.value).startswith(str(tmp_path / "a.plan"))
    assert "\n" not in str(error.value)


def test_a_survey_without_generated_items_is_told(tmp_path: Path) -> None:
    data = plan()
    del data["mission"]["items"][2]["TransectStyleComplexItem"]["Items"]
    with pytest.raises(PlanError, match=r"items\[2\]\.TransectStyleComplexItem\.Items: missing"):
        read(data, tmp_path)


@pytest.mark.parametrize("text", ["", "{", "[]", '"Plan"'])
def test_what_is_no_plan_is_told(text: str, tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"a\.plan: "):
        read(text, tmp_path)


def test_what_is_nested_deeply_is_told(tmp_path: Path) -> None:
    for deep in (1000, 100_000):
        with pytest.raises(PlanError, match=r"a\.plan: nested too deeply; allowed: a plan as QGroundControl saves it"):
            read('{"fileType": ' + "[" * deep + "]" * deep + "}", tmp_path)


def test_the_largest_numbers_travel_and_unset_ones_may_be_nan(tmp_path: Path) -> None:
    data = plan()
    largest = 3.4028234663852886e38
    data["mission"]["items"][0]["params"] = [largest, -largest, None, math.nan, math.nan, 8.0, largest]
    data["mission"]["items"][1]["params"][4:6] = [2**31 - 1, -(2**31)]
    upload = MissionUpload(1, read(data, tmp_path).mission)
    for seq in (0, 1):
        upload._item(seq).pack(mavlink.MAVLink(None))
    item = upload.items[0]
    assert math.isnan(item.param3) and math.isnan(item.param4) and item.x == item.y == 0x7FFFFFFF


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="No such file"):
        read_plan(tmp_path / "none.plan")


def test_lines_lie_a_spacing_apart_and_are_flown_there_and_back() -> None:
    lines = transects(CORNERS, 12.0, 0.0)
    assert len(lines) == 7
    for (a1, a2), (b1, _) in pairwise(lines):
        assert distance_m(*a1, *a2) == pytest.approx(80.0, abs=0.05)
        assert distance_m(*a2, *b1) == pytest.approx(12.0, abs=0.05)
    across = transects(CORNERS, 20.0, 90.0)
    assert len(across) == 4
    assert across[0][0][0] == pytest.approx(across[0][1][0], abs=1e-7)


def test_lines_of_a_triangle_end_at_its_edges() -> None:
    triangle = [from_metres(n, e, *HOME[:2]) for n, e in ((0, 0), (60, 30), (0, 60))]
    lengths = [distance_m(*a, *b) for a, b in transects(triangle, 20.0, 0.0)]
    assert lengths == pytest.approx([20.0, 60.0, 20.0], abs=0.1)


def test_a_survey_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="three or more"):
        survey_plan(HOME, CORNERS[:2], 15.0, 12.0, 5.0)
    with pytest.raises(ValueError, match="spacing_m: 0"):
        survey_plan(HOME, CORNERS, 15.0, 0, 5.0)


def test_a_plan_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="can't write plan"):
        write_plan(tmp_path / "none" / "a.plan", plan())
