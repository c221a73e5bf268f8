"""An autopilot from outside in a run: started, flown with a companion of ours, supervised, ended. Ours stands in for
PX4."""

import json
import sys
from pathlib import Path

import yaml

from tests.missions.runs import Run, short_scenario
from tests.missions.test_run_processes import assert_nothing_is_left

COMMAND = [
    "{python}",
    "-P",
    "-m",
    "sitl_emu.autopilot",
    "--model",
    "{model}",
    "--instance",
    "{instance}",
    "--root",
    "{rootfs}",
]


def with_autopilot(folder: Path, limit_s: float, command: list[str]) -> Path:
    path = short_scenario(folder, limit_s)
    scenario = yaml.safe_load(path.read_text())
    scenario["vehicles"][0]["autopilot"] = {"command": command, "env": {"WHO": "{name} {instance}"}}
    path.write_text(yaml.safe_dump(scenario))
    return path


def test_a_companion_of_ours_flies_an_autopilot_from_outside(tmp_path: Path) -> None:
    with Run(with_autopilot(tmp_path, 25.0, COMMAND), tmp_path / "run", "--speed", "max") as run:
        assert run.wait(200) == 1, run.text
        assert_nothing_is_left(run)
    events = [json.loads(line) for line in (tmp_path / "run" / "events.jsonl").read_text().splitlines()]
    of_uas = [(event["event"], event.get("text", "")) for event in events if event["vehicle"] == "uas"]
    assert ("armed", "") in of_uas and ("phase", "scanning: flying the survey") in of_uas
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["outcome"] == "time limit reached"
    climbed_m = max(
        -float(row.split(",")[3]) for row in (tmp_path / "run" / "truth-uas.csv").read_text().splitlines()[1:]
    )
    assert climbed_m > 3.0
    assert "connected to the simulator" in (tmp_path / "run" / "logs" / "autopilot-uas.log").read_text()
    assert (tmp_path / "run" / "uas.ulg").resolve().is_relative_to(tmp_path / "run" / "rootfs" / "uas"), "its own file"


def test_one_that_ends_is_named_and_its_last_words_are_told(tmp_path: Path) -> None:
    ends = [sys.executable, "-c", "import os, sys; print('I am', os.environ['WHO']); sys.exit(4)"]
    with Run(with_autopilot(tmp_path, 600.0, ends), tmp_path / "run", "--speed", "max") as run:
        assert run.wait(60) == 1
        assert "autopilot uas" in run.text and "ended with exit status 4" in run.text and "I am uas 5" in run.text
        assert_nothing_is_left(run)
