"""Three aircraft talk sealed over one bad air in a run, one of them behind a house, and agree on who serves."""

import json
from pathlib import Path

import pytest

from sitl_emu.core import dialect as mavlink
from tests.missions.installed import run_in_yard
from tests.missions.runs import FIRST_INSTANCE

PLACES = {"before": (0.0, 0.0), "behind": (35.0, 10.0), "beside": (35.0, -8.0)}
"""Of examples/own_world's house."""
RADIO = {"shared": True, "loss": 0.2, "bandwidth_bit_s": 57600, "obstructed_range_m": 10}


def run(folder: Path) -> Path:
    companion = {"mission": "three-claim", "options": {"first": FIRST_INSTANCE + 1}}
    vehicles = [
        {"name": name, "model": "iris", "start": {"north_m": north, "east_m": east}, "companion": companion}
        for name, (north, east) in PLACES.items()
    ]
    folder.mkdir()
    return run_in_yard(folder, "three_claim", {}, vehicles=vehicles, peer_radio=RADIO, time_limit_s=60, seed=4)


@pytest.mark.slow
def test_three_agree_over_one_bad_air(tmp_path: Path) -> None:
    first = run(tmp_path / "one")
    summary = json.loads((first / "summary.json").read_text())
    events = [json.loads(line) for line in (first / "events.jsonl").read_text().splitlines()]
    served = [event for event in events if event["event"] == "served"]
    assert [(event["vehicle"], event["sightings"]) for event in served] == [("before", 3)]
    said = {event["text"] for event in events if "swarm key" in event.get("text", "")}
    assert len(said) == 1, "one key"
    assert said.pop().endswith("made of the run's seed, for simulation alone")
    radio = {name: (counts["sent"], counts["lost"]) for name, counts in summary["radio"].items()}
    sent, lost = radio["before>behind"]
    assert sent == lost > 0, "the house is in between"
    sent, lost = radio["before>beside"]
    assert 0.1 < lost / sent < 0.3
    logs = sorted(first.glob("*-peer.tlog"))
    assert len(logs) == 3
    for log in logs:
        content = log.read_bytes()
        assert content.count(bytes([mavlink.MAVLINK_MSG_ID_TUNNEL & 255, mavlink.MAVLINK_MSG_ID_TUNNEL >> 8, 0])) > 20
