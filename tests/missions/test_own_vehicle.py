"""examples/own_vehicle, copied away from the checkout, flies as its file says: own folder, wind, sensors, faults."""

import json
import os
import shutil
import sys
from pathlib import Path

import pytest

import vehicles
from sitl_emu.run.scenario import load
from tests.missions.runs import Run

ROOT = Path(__file__).parents[2]


def test_a_vehicle_of_ones_own_flies_its_scenario_outside_the_checkout(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples/own_vehicle", tmp_path / "own_vehicle")
    shutil.copy(ROOT / "examples/own_companion.py", tmp_path)
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    with Run(Path("own_vehicle/flight.yaml"), tmp_path / "run", "--speed", "2", cwd=tmp_path, env=environment) as run:
        assert run.wait(200) == 0, run.text + (tmp_path / "run/logs/companion-uas.log").read_text()
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert summary["outcome"] == "success" and len(summary["faults"]) == 1 and not summary["faults_left"]
    events = [json.loads(line) for line in (tmp_path / "run/events.jsonl").read_text().splitlines()]
    at = {f"{event['event']} {event.get('text', '')}".strip(): event["time_s"] for event in events}
    assert at["fault mag off"] - at["armed"] == pytest.approx(8.0)
    assert at["fault_ended mag on again"] - at["fault mag off"] == pytest.approx(5.0)
    rows = [row.split(",") for row in (tmp_path / "run/truth-uas.csv").read_text().splitlines()[1:]]
    assert max(-float(row[3]) for row in rows) > 5.0 and -float(rows[-1][3]) < 0.5


def test_the_example_is_an_iris_but_for_what_it_says() -> None:
    asked = load(ROOT / "examples/own_vehicle/flight.yaml").vehicles[0].model_data
    mine, iris = vehicles.load(asked.model), vehicles.load("iris")
    assert mine.mass_kg == iris.mass_kg + 0.4 and mine.propulsion == iris.propulsion
    assert {name for name in iris.airframe if mine.airframe[name] != iris.airframe[name]} == {"MPC_THR_HOVER"}
