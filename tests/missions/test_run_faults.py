"""Faults in a run of real processes: they come when the timeline says, and the run says what was injected."""

import filecmp
import json
from pathlib import Path
from typing import Any

from sitl_emu.run.score import WALL_CLOCK_KEYS
from tests.missions.runs import Run, short_scenario
from tests.missions.test_run_processes import assert_logs_are_readable, assert_nothing_is_left

FAULTS = [
    {"at_s": 1.0, "vehicle": "uas", "fault": {"sensor": "mag"}, "for_s": 1.5},
    {"at_s": 1.2, "vehicle": "ugv", "fault": {"radio": "out"}, "for_s": 1.0},
    {
        "when": {"event": "fault_ended", "vehicle": "uas", "after_s": 0.5},
        "vehicle": "ugv",
        "fault": {"kill": "autopilot"},
    },
    {"at_s": 4.0, "vehicle": "uas", "fault": {"kill": "companion"}},
    {"when": {"event": "target_confirmed"}, "vehicle": "uas", "fault": {"battery_charge": 0.1}},
]
KILLED = "injected fault: autopilot ugv killed at 3.0 s; injected fault: companion uas killed at 4.0 s"


def summary(folder: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    for key in WALL_CLOCK_KEYS:
        read.pop(key)
    return read


def test_faults_come_at_their_time_at_any_speed_and_are_told_as_injected(tmp_path: Path) -> None:
    scenario = short_scenario(tmp_path, 6.0, faults=FAULTS)
    for name, speed in (("fast", "max"), ("slow", "1.5")):
        with Run(scenario, tmp_path / name, "--speed", speed) as run:
            assert run.wait(100) == 1, run.text
            assert "was killed by SIGKILL" not in run.text, "no accident"
            assert KILLED in run.text and "uas      fault: mag off" in run.text
            assert_nothing_is_left(run)
    fast, slow = tmp_path / "fast", tmp_path / "slow"
    events = [json.loads(line) for line in (fast / "events.jsonl").read_text().splitlines()]
    assert [(event["time_s"], event["vehicle"], event["text"]) for event in events if "fault" in event["event"]] == [
        (1.0, "uas", "mag off"),
        (1.2, "ugv", "peer radio out"),
        (2.2, "ugv", "peer radio back"),
        (2.5, "uas", "mag on again"),
        (3.0, "ugv", "autopilot killed"),
        (4.0, "uas", "companion killed"),
    ]
    assert not [event for event in events if event["vehicle"] == "uas" and event["time_s"] > 4.1]
    same = ("events.jsonl", "uas-gcs.tlog", "uas-onboard.tlog", "ugv-peer.tlog", "truth-uas.csv", "truth-ugv.csv")
    assert not [name for name in same if not filecmp.cmp(fast / name, slow / name, shallow=False)]
    told = summary(fast)
    assert told == summary(slow)
    assert told["outcome"].endswith(KILLED)
    assert told["faults"][0] == "uas: mag off at 1.0 s" and told["faults_left"] == ["uas: battery at 10%"]
    assert_logs_are_readable(fast)
    assert (fast / "ugv.ulg").stat().st_size > 1000, "of the autopilot that was killed"
