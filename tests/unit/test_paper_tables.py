"""The disaster-response paper's tables: what is flown for them, and how what came of it is told."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.run import checks
from sitl_emu.run.campaign import campaign as campaigns
from sitl_emu.run.campaign.arms import arms_of, variation
from sitl_emu.run.scenario import find
from tools.disaster import detector_table, level_camera
from tools.disaster.paper_tables import FAULTS, LOST, ROWS, TABLES, faults_of, is_safe, main, summaries_in, table_of


def summary(**other: Any) -> dict[str, Any]:
    """Of a mission that delivered, 1.5 m off."""
    return {
        "ending": "delivered",
        "abort_reason": None,
        "delivered": 1,
        "deliveries": [{"to_target_m": 3.2, "to_middle_m": 6.1}],
        "targets_found": 2,
        "targets_total": 3,
        "diversions": 1,
        "diversions_false": 0,
        "diverted": [{"error_m": 1.5, "false": False, "located": "edge"}],
        "terrain": {"rms_m": 0.5},
        "scan_height": {"rms_m": 2.0},
        "coverage_s": 100.0,
        "served_twice": 0,
        "separation_m": None,
        **other,
    }


@pytest.mark.parametrize("name", TABLES)
def test_every_condition_is_a_scenario_that_can_be_flown(name: str) -> None:
    table = TABLES[name]
    for scenario in table.scenarios:
        arms = arms_of(find(scenario), [variation(text) for text in table.vary])
        assert len({arm.name for arm in arms}) == len(arms)
    assert all(set(figures) <= set(ROWS) for figures in table.paper.values())


def test_a_level_camera_hangs_from_a_gimbal_and_all_else_is_the_missions(tmp_path: Path) -> None:
    level, own = find(str(level_camera.written(tmp_path, "disaster-debris"))), find("disaster-debris")
    (flown,), (arm,) = arms_of(level, []), arms_of(own, [])
    (one,), (other,) = flown.scenario.vehicles, arm.scenario.vehicles
    assert one.camera is not None and other.camera is not None
    assert one.camera == other.camera.model_copy(update={"mount": "gimbal"})
    assert one.model_copy(update={"camera": None, "model": other.model}) == other.model_copy(update={"camera": None})
    vehicle, responder = vehicles.load(one.model), vehicles.load("responder")
    assert vehicle.gimbal == vehicles.load("m600").gimbal is not None
    assert (vehicle.mass_kg, vehicle.propulsion) == (responder.mass_kg, responder.propulsion)
    assert set(vehicle.airframe) - set(responder.airframe) == {"MNT_MODE_IN", "MNT_MODE_OUT"}
    checks.check(flown.scenario, 1, level)


def test_single_frames_are_told_by_their_spread_and_by_how_many_are_near_enough() -> None:
    alarms = {"1": {"total": 8, "false": 2}, "3": {"total": 6, "false": 0}}
    those = [
        summary(sightings=[{"error_m": 1.0, "time_s": 60.0}, {"error_m": 7.0, "time_s": 50.0}], alarms=alarms),
        summary(sightings=[{"error_m": 5.0, "time_s": 70.0}], alarms={"1": {"total": 1, "false": 0}}),
    ]
    text = table_of(TABLES["level"], {"ours": those})
    assert "| location by one frame, RMSE | 5.00 m |" in text
    assert "| location by one frame, median | 5.0 m |" in text
    assert "| located by one frame within 5 m | 2 of 3 |" in text
    assert "| a mission's first target located so | 1 of 2 |" in text
    assert "| false alarms of one frame | 2 of 9 |" in text
    assert "| false alarms of three in a row | 0 of 6 |" in text


def test_titles_stand_over_their_arms() -> None:
    for name in ("together", "lost"):
        (scenario,), vary, titles = TABLES[name].scenarios, TABLES[name].vary, TABLES[name].titles
        for title, arm in zip(titles, arms_of(find(scenario), [variation(text) for text in vary]), strict=True):
            count, what = title.split(", ")
            assert len(arm.scenario.vehicles) == {"two": 2, "four": 4}[count]
            if name == "together":
                assert arm.scenario.peer_radio.loss == {"no loss": 0.0, "10 %": 0.1, "30 %": 0.3}[what]
            else:
                (fault,) = arm.scenario.faults
                assert fault.model_dump(exclude_defaults=True) == LOST[what.removeprefix("its ")]
    assert "| | two, no loss (1) |" in table_of(TABLES["together"], {str(arm): [summary()] for arm in range(6)})
    (alone,) = arms_of(find(*TABLES["alone"].scenarios), [variation(text) for text in TABLES["alone"].vary])
    assert len(alone.scenario.vehicles) == 1


def test_an_arm_is_a_column_and_the_paper_stands_beside_it() -> None:
    lost = summary(ending="aborted", abort_reason="drift", delivered=0, terrain=None, coverage_s=None, diverted=[])
    lost["deliveries"] = []
    lines = table_of(TABLES["5"], {"altitude=fixed": [summary(), lost], "altitude=terrain": [summary()]}).splitlines()
    rows = {cells[0]: cells[1:] for line in lines[2:] for cells in [[cell.strip() for cell in line.split("|")[1:-1]]]}
    assert rows["parcel within 5 m"] == ["1 of 2", "1 of 1", "14 of 20", "18 of 20"]
    assert rows["targets found"] == ["4 of 6", "2 of 3", "80 %", "90 %"]
    assert rows["parcel from its target, at most"][:2] == ["3.2 m", "3.2 m"]
    assert rows["parcels kept for"][:2] == ["drift (1)", "–"]
    assert rows["location RMSE"] == ["1.50 m", "1.50 m", "3.8 m", "2.3 m"]
    assert rows["terrain RMS error"] == ["0.50 m", "0.50 m", "", "< 0.8 m"]
    assert rows["all lines flown after, mean"][:2] == ["100 s (1 of 2)", "100 s (1 of 1)"]
    assert "two vehicles apart, at least" not in rows


def test_of_flights_to_middles_those_that_let_go_of_nothing_count_too() -> None:
    near, far = {"error_m": 3.1, "false": False, "located": "middle"}, {"error_m": 30.0, "false": True}
    over = summary(diverted=[near], deliveries=[{"to_target_m": 0.0, "to_middle_m": 3.3}])
    astray = summary(diverted=[{**far, "located": "middle"}], deliveries=[{"to_target_m": 25.0, "to_middle_m": 29.0}])
    none = summary(diverted=[near], deliveries=[], ending="aborted")
    no_target = summary(diverted=[], deliveries=[], targets_total=0)
    text = table_of(TABLES["printed"], {"ours": [over, astray, none, no_target]})
    assert "| parcel within 5 m of a target's middle | 1 of 3 | 14 of 20 |" in text
    assert "| missions that centred over a target | 1 of 3 | 80 % |" in text
    assert "centred over a target" not in table_of(TABLES["5"], {"one": [summary()], "other": [summary()]})


def test_the_detectors_classes_stand_beside_the_papers() -> None:
    one = {"precision": 0.9, "recall": 0.8, "f1": 0.8471, "ap50": 0.8858}
    scores = {"classes": dict.fromkeys(("water_body", "debris_field", "fire_region"), one), "map50": 0.8858}
    lines = detector_table.rows_of({**scores, "precision": 0.9, "recall": 0.8}).splitlines()
    assert lines[4] == "| water_body | 0.90 | 0.80 | 0.85 | 0.886 | 0.87, 0.84, 0.85, 0.89 |"
    assert lines[7] == "| all | 0.90 | 0.80 | 0.85 | 0.886 | 0.81, 0.78, 0.79, 0.84 |"


def test_a_fault_may_end_a_delivery_for_its_own_reasons_alone() -> None:
    battery = FAULTS[0]
    assert is_safe(summary(), battery)
    assert is_safe(summary(ending="aborted", abort_reason="low battery"), battery)
    assert not is_safe(summary(ending="aborted", abort_reason="drift"), battery)
    assert not is_safe(summary(ending="misdelivered"), battery)
    assert not is_safe(summary(ending="unfinished"), battery)
    told = faults_of({fault.what: [summary(), summary(ending="unfinished")] for fault in FAULTS})
    assert told.count("1 of 2") == len(FAULTS)


def test_results_are_those_of_the_campaigns_own_arms(tmp_path: Path) -> None:
    (tmp_path / "campaign.json").write_text(json.dumps({"arms": {"b": {}, "a": {}}}))
    for arm, seed, what in (("a", 1, summary()), ("a", 2, None), ("gone", 1, summary())):
        path = tmp_path / "results" / arm / f"seed-{seed}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"arm": arm, "seed": seed, "summary": what}))
    assert {name: len(those) for name, those in summaries_in(tmp_path).items()} == {"b": 0, "a": 1}
    assert list(summaries_in(tmp_path)) == ["b", "a"]


def test_ctrl_c_ends_all_tables_and_not_one_campaign_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flown = list[str]()

    def stopped(wanted: campaigns.Wanted, console: object) -> int:
        flown.append(wanted.scenario)
        assert wanted.out is not None
        wanted.out.mkdir(parents=True)
        (wanted.out / "campaign.json").write_text('{"arms": {}}')
        return campaigns.EXIT_STOPPED

    monkeypatch.setattr(campaigns, "campaign", stopped)
    monkeypatch.setattr(sys, "argv", ["paper_tables", "--only", "4", "wind", "--out", str(tmp_path / "out")])
    assert main() == campaigns.EXIT_STOPPED
    assert flown == ["disaster"]
