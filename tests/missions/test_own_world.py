"""A world of one's own, as the README says: copied out of the checkout, flown in; and what a crash in it comes to."""

import csv
import json
import re
import shutil
from pathlib import Path

import pytest
import yaml

from tests.missions.runs import Run

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples/own_world"
LIMIT_S = 150.0
ROOF_M, WALL_NORTH_M = 4.0, 39.8
IRIS_REACH_M = 0.1515 + 0.128


def last_place(out: Path) -> tuple[float, float, float]:
    """North, east, up."""
    with (out / "truth-iris.csv").open() as file:
        *_, row = csv.DictReader(file)
    return float(row["north_m"]), float(row["east_m"]), -float(row["down_m"])


def test_the_readme_says_what_is_tested_here() -> None:
    readme = (ROOT / "README.md").read_text()
    assert re.search(r"sitl-emu run examples/own_world/scenario\.yaml", readme)
    assert re.search(r"sitl-emu launch iris:2 --world examples/own_world/yard\.yaml", readme)


def test_an_iris_lands_on_the_roof_of_a_world_file(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLE, tmp_path / "own")
    with Run(tmp_path / "own/scenario.yaml", tmp_path / "run", "--speed", "3") as run:
        assert run.wait(LIMIT_S) == 0, run.text
    north_m, east_m, up_m = last_place(run.out)
    assert abs(north_m - 25.0) < 2.0 and abs(east_m - 10.0) < 2.0
    assert up_m == pytest.approx(ROOF_M + 0.1, abs=0.05)
    assert "house" not in (run.out / "events.jsonl").read_text(), "a landing is no crash"
    again = yaml.safe_load((run.out / "scenario.yaml").read_text())
    assert again["world"] == "world.yaml" and (run.out / "world.yaml").is_file(), "the run's folder can be run again"


def test_a_crash_is_told_and_is_the_outcome(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLE, tmp_path / "own")
    shutil.copy(Path(__file__).with_name("into_the_wall.py"), tmp_path / "own")
    path = tmp_path / "own/scenario.yaml"
    scenario = yaml.safe_load(path.read_text())
    scenario["vehicles"][0]["companion"] = {"command": ["{python}", "into_the_wall.py", "{connect}"]}
    del scenario["vehicles"][0]["camera"]
    path.write_text(yaml.safe_dump(scenario))
    with Run(path, tmp_path / "run", "--speed", "3") as run:
        assert run.wait(LIMIT_S) == 1, run.text
    events = [json.loads(line) for line in (run.out / "events.jsonl").read_text().splitlines()]
    crash = next(event for event in events if event["event"] == "crashed")
    assert (crash["vehicle"], crash["other"]) == ("iris", "wall") and crash["speed_m_s"] == pytest.approx(5.0, abs=0.7)
    assert json.loads((run.out / "summary.json").read_text())["outcome"] == "iris crashed into wall"
    assert "outcome: iris crashed into wall" in run.text
    with (run.out / "truth-iris.csv").open() as file:
        rows = [(float(row["time_s"]), float(row["north_m"])) for row in csv.DictReader(file)]
    at_crash = min(rows, key=lambda row: abs(row[0] - crash["time_s"]))[1]
    assert at_crash + IRIS_REACH_M == pytest.approx(WALL_NORTH_M, abs=0.3), "a row of truth each 0.1 s"


# --- examples/flooded_street ---------------------------------------------------------------------------------------


def flooded(tmp_path: Path, north_m: float, east_m: float) -> Path:
    """The example's scenario, copied out of the checkout; the iris lands at a place."""
    shutil.copytree(ROOT / "examples/flooded_street", tmp_path / "street")
    path = tmp_path / "street/scenario.yaml"
    scenario = yaml.safe_load(path.read_text())
    command = scenario["vehicles"][0]["companion"]["command"]
    assert command[-2:] == ["4", "-37"]
    scenario["vehicles"][0]["companion"]["command"] = [*command[:-2], str(north_m), str(east_m)]
    path.write_text(yaml.safe_dump(scenario))
    return path


def test_an_iris_crosses_a_flooded_street(tmp_path: Path) -> None:
    assert "sitl-emu run examples/flooded_street/scenario.yaml" in (ROOT / "README.md").read_text()
    with Run(flooded(tmp_path, 4, -37), tmp_path / "run", "--speed", "3") as run:
        assert run.wait(LIMIT_S) == 0, run.text
    north_m, east_m, up_m = last_place(run.out)
    assert abs(north_m - 4.0) < 2.0 and abs(east_m + 37.0) < 2.0 and up_m > 1.5
    assert (run.out / "street.png").is_file() and "level_m: 0.0" in (run.out / "world.yaml").read_text()


def test_who_lands_in_the_flood_is_lost(tmp_path: Path) -> None:
    path = flooded(tmp_path, 8, 8)
    scenario = yaml.safe_load(path.read_text())
    del scenario["vehicles"][0]["camera"]
    path.write_text(yaml.safe_dump(scenario))
    with Run(path, tmp_path / "run", "--speed", "3") as run:
        assert run.wait(LIMIT_S) == 1, run.text
    assert "outcome: iris came down in water (flood)" in run.text
    events = [json.loads(line) for line in (run.out / "events.jsonl").read_text().splitlines()]
    crash = next(event for event in events if event["event"] == "crashed")
    assert (crash["other"], crash["cause"]) == ("flood", "in water") and 0.1 < crash["speed_m_s"] < 2.0
    assert last_place(run.out)[2] < 0.0, "it sinks"
