"""The disaster mission in a run: it finds a slab, drops its parcel beside it and not on who stands there, scans on."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from tests.missions.runs import FIRST_INSTANCE

LIMIT_S = 340.0
# Lines are long enough for the slab to be confirmed 5 s before the first one's end, whatever the noise.
WORLD = {
    "name": "plain",
    "origin": {"lat_deg": 47.397742, "lon_deg": 8.545594, "alt_amsl_m": 489.4},
    "places": {"home": {"north_m": 0, "east_m": 0}},
    "area_m": [[4, -10], [4, 16], [40, 16], [40, -10]],
    "ground": {"use": "asphalt"},
    "solids": [
        {
            "name": "slab",
            "label": "debris slab",
            "north_m": 20,
            "east_m": 5,
            "box": {"size_m": [6, 5, 0.4]},
            "colour": [0.02, 0.05, 0.9],
        }
    ],
    "things": [
        {"label": "person", "north_m": 14, "east_m": 3, "radius_m": 0.3, "height_m": 1.75, "colour": [0.8, 0.2, 0.1]}
    ],
}
UAS = {
    "name": "uas",
    "model": "responder",
    "parcel": {},
    "camera": {"mount": "nadir", "rate_hz": 4, "resolution": [320, 240]},
}
OUTSIDE = ["{python}", "-P", "-m", "sitl_emu.autopilot", "--model", "{model}", "--instance", "{instance}",
           "--root", "{rootfs}"]  # fmt: skip
TRANSCRIPT = [
    "waiting for health", "uploading", "plan", "taking off", "scanning",
    "target_confirmed", "engaging", "delivering", "released", "parcel_seen", "resuming", "scanning",
    "line_scanned", "scanning", "line_scanned", "returning", "region", "landed",
]  # fmt: skip
"""What the companion does, in order: its phases, and what it tells of its work."""
TOLD = {"plan", "target_confirmed", "released", "parcel_seen", "line_scanned", "region"}
OPTIONS = {"area": "world", "detector": "tests.missions.blue_slabs:Blue", "scan_altitude_m": 15}


def run(
    folder: Path,
    status: int,
    options: Mapping[str, object] | None = None,
    world: Mapping[str, object] = WORLD,
    vehicle: Mapping[str, object] = UAS,
    limit_s: float = LIMIT_S,
    where: tuple[str, ...] = ("--instance", str(FIRST_INSTANCE)),
    **changes: object,
) -> dict[str, Any]:
    """Runs the mission in a world, or a kind of one; its summary, with the events under "events"."""
    (folder / "plain.yaml").write_text(yaml.safe_dump(dict(world), sort_keys=False))
    companion = {"mission": "disaster", "options": {**OPTIONS, **(options or {})}}
    scenario = {"name": "slab", "world": dict(world) if "kind" in world else "plain.yaml", "time_limit_s": 150}
    (folder / "slab.yaml").write_text(
        yaml.safe_dump(scenario | {"vehicles": [{**vehicle, "companion": companion}]} | changes)
    )
    command = [sys.executable, "-P", "-m", "sitl_emu", "run", str(folder / "slab.yaml"), "--speed", "max"]
    done = subprocess.run(
        [*command, "--out", str(folder / "run"), *where],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        timeout=limit_s,
        check=False,
    )
    assert done.returncode == status, done.stdout + done.stderr
    summary: dict[str, Any] = json.loads((folder / "run/summary.json").read_text())
    events = [json.loads(line) for line in (folder / "run/events.jsonl").read_text().splitlines()]
    return summary | {"events": events}


def transcript(events: list[dict[str, Any]]) -> list[str]:
    """Of a run's events, as TRANSCRIPT has it."""
    return [event.get("phase", event["event"]) for event in events if event["event"] in TOLD | {"phase"}]


def test_it_delivers_beside_a_slab_and_scans_on(tmp_path: Path) -> None:
    got = run(tmp_path, 0)
    assert (got["ending"], got["delivered"], got["aborts"]) == ("delivered", 1, [])
    (parcel,) = got["deliveries"]
    assert parcel["safe"] and 0.0 < parcel["to_target_m"] <= 5.0
    assert (got["targets_found"], got["targets_total"], got["regions_false"]) == (1, 1, 0)
    assert (got["diversions"], got["diversions_false"], got["scan_share"]) == (1, 0, 1.0)
    assert got["geolocation_rmse_m"] < 2.0
    assert transcript(got["events"]) == TRANSCRIPT
    (released,) = (event for event in got["events"] if event["event"] == "released")
    assert abs(released["height_m"] - 7.0) < 1.0, "as the lidar measures it"
    texts = [event["text"] for event in got["events"] if event["event"] == "text"]
    assert any(text.startswith("Parcel let go") for text in texts)


def test_with_an_autopilot_from_outside_its_transcript_differs_in_time_alone(tmp_path: Path) -> None:
    """Which is ours here, by TCP as a real PX4 is; that is not in step with the run, so noise differs."""
    got = run(tmp_path, 0, vehicle={**UAS, "autopilot": {"command": OUTSIDE}})
    assert (got["ending"], got["delivered"]) == ("delivered", 1)
    assert transcript(got["events"]) == TRANSCRIPT


def test_with_an_empty_battery_the_parcel_stays_on_board(tmp_path: Path) -> None:
    drained = {"vehicle": "uas", "fault": {"battery_charge": 0.22}, "when": {"event": "target_confirmed"}}
    got = run(tmp_path, 1, faults=[drained])
    assert (got["ending"], got["abort_reason"], got["deliveries"]) == ("aborted", "low battery", [])
    texts = [event["text"] for event in got["events"] if event["event"] == "text"]
    assert any("low battery" in text and "the parcel stays on board" in text for text in texts)
    assert got["events"][-1]["event"] != "crashed"


def test_it_keeps_its_height_over_hills(tmp_path: Path) -> None:
    """Which lie 2.6 m below home in the mean: at a fixed altitude it would be 2.7 m off."""
    camera = {"mount": "nadir", "rate_hz": 5, "resolution": [320, 240]}
    hilly = {"kind": "debris_field", "options": {"size_m": 60, "relief_m": 6}}
    options = {"altitude": "terrain", "parcel": "no", "scan_altitude_m": 20, "margin_m": 14}
    got = run(tmp_path, 1, options, vehicle={**UAS, "camera": camera}, world=hilly, seed=3)
    assert got["scan_share"] == 1.0
    height = got["scan_height"]
    assert height["wanted_m"] == 20.0 and abs(height["mean_m"] - 20.0) < 0.8 and height["rms_m"] < 1.2, height
