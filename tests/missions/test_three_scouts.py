"""Three scouts, one rover: what they find is inspected, each target by one drive, and each scout hears of its own."""

import json
from pathlib import Path

import pytest
import yaml

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
