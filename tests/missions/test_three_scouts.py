"""Three scouts, one rover: what they find is inspected, each target by one drive, and each scout hears of its own."""

import json
import math
from itertools import groupby
from pathlib import Path

import pytest
import yaml

from sitl_emu.missions.agriculture import field_map
from sitl_emu.missions.agriculture.row_route import is_among_rows
from sitl_emu.run.scenario import find
from tests.missions.runs import Run

LIMIT_S = 600.0


def small(folder: Path) -> Path:
    """The scenario on the smallest field, with few frames: quick, and as good for the queue."""
    scenario = yaml.safe_load(find("agriculture-three-scouts").read_text())
    scenario["world"]["options"] = {"size_m": [60, 60], "targets": 4, "distractors": 4, "relief_m": 2}
    for place, vehicle in enumerate(scenario["vehicles"]):
        vehicle["camera"]["rate_hz"] = 5
        if vehicle["name"] != "ugv":
            vehicle["start"]["east_m"] = 20.0 * place
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump(scenario))
    return path


@pytest.mark.timeout(LIMIT_S + 30.0)
def test_a_rover_serves_the_targets_of_three_scouts_once_each(tmp_path: Path) -> None:
    with Run(small(tmp_path), tmp_path / "run", "--speed", "max", "--seed", "1") as run:
        status = run.wait(LIMIT_S)
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    events = [json.loads(line) for line in (tmp_path / "run/events.jsonl").read_text().splitlines()]
    assert (status == 0) == (summary["outcome"] == "success")
    sent = [(event["vehicle"], event["target"]) for event in events if event["event"] == "target_sent"]
    reported = [(event["vehicle"], event["target"]) for event in events if event["event"] == "report_received"]
    assert sorted(sent) == sorted(reported) == sorted(set(sent))
    assert len({vehicle for vehicle, _ in sent}) == 3  # or the rover was not shared
    accepted = [event for event in events if event["event"] == "target_accepted" and event["vehicle"] == "ugv"]
    jobs = sorted({event["job"] for event in accepted})
    assert [event["job"] for event in events if event["event"] == "target_started"] == jobs
    assert [event["job"] for event in events if event["event"] == "stopped"] == jobs
    assert not [event for event in events if event["event"] == "failed"]
    assert summary["targets_confirmed"] >= 3 and summary["false_confirmations"] == summary["wrong_labels"] == 0
    assert summary["armed_at_end"] == []
    drives_along_the_rows_and_home(tmp_path / "run")


def drives_along_the_rows_and_home(folder: Path) -> None:
    """By the truth, within what its own GPS is good for: along a lane whenever it is in the crop, at last at home."""
    from sitl_emu.run.score import read_track

    vehicles = yaml.safe_load((folder / "scenario.yaml").read_text())["vehicles"]
    told = next(each["companion"]["options"]["field_map"] for each in vehicles if each["name"] == "ugv")
    field = field_map.read({"origin": [0, 0], "outline_m": [[0, 0], [0, 60], [60, 60], [60, 0]], **told})
    track = read_track(folder, "ugv")
    places = list(zip(track.north_m, track.east_m, strict=True))
    visits = [list(group) for inside, group in groupby(places, lambda spot: is_among_rows(field, spot)) if inside]
    driven = [visit for visit in visits if math.dist(visit[0], visit[-1]) > 10.0]
    assert driven
    for visit in visits:
        across = [east_m for _, east_m in visit]
        assert max(across) - min(across) < 1.5 * field.row_spacing_m
    assert math.dist(places[-1], places[0]) < 2.0
