"""A parcel in a run: what a companion drops is told, with the place where it comes to rest, the same in every run."""

import csv
import json
from pathlib import Path

import pytest

from sitl_emu.run.checks import check
from sitl_emu.run.scenario import ScenarioError, load
from tests.missions.installed import YARD, run_in_yard

LADEN: dict[str, object] = {
    "name": "uas",
    "model": "responder",
    "start": "home",
    "parcel": {"mass_kg": 1.5},
    "sensors": {"gps": "m8n"},
}


def test_it_is_dropped_rests_and_is_told_twice_the_same(tmp_path: Path) -> None:
    left = []
    for name in ("one", "other"):
        folder = tmp_path / name
        folder.mkdir()
        out = run_in_yard(folder, "drop_parcel", LADEN, {})
        left.append([(out / file).read_text() for file in ("events.jsonl", "loose.csv", "truth-uas.csv")])
    assert left[0] == left[1]
    events = {event["event"]: event for event in map(json.loads, left[0][0].splitlines())}
    rest, release = events["parcel at rest"], events["parcel released"]
    assert rest["name"] == release["name"] == "parcel of uas"
    assert rest["time_s"] > release["time_s"] and release["down_m"] < -1.5
    last = list(csv.DictReader(left[0][1].splitlines()))[-1]
    for axis in ("north_m", "east_m", "down_m"):
        assert float(last[axis]) == pytest.approx(rest[axis], abs=0.002)


@pytest.mark.parametrize(
    ("vehicle", "complaint"),
    [
        ({"model": "iris"}, "vehicles.0.parcel: iris has no release that could hold one"),
        ({"parcel": {"colour": 3}}, "vehicles.0.parcel: unknown field 'colour' = 3; allowed are: mass_kg"),
        ({"sensors": {"gps": "m9"}}, "vehicles.0.sensors: gps = 'm9': known are m8n"),
    ],
)
def test_a_scenario_that_asks_for_what_cannot_be_is_refused(
    tmp_path: Path, vehicle: dict[str, object], complaint: str
) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text(
        json.dumps({"name": "x", "world": str(YARD), "time_limit_s": 9, "vehicles": [{**LADEN, **vehicle}]})
    )
    with pytest.raises(ScenarioError) as told:
        check(load(path), 1, path)
    assert complaint in str(told.value)
