"""Scoring: what belongs to which target, what counts as what, and that a run has one outcome, told everywhere alike."""

import io
import json
import re
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.missions.agriculture.page import page as agriculture_page
from sitl_emu.missions.mission import Mission, Program
from sitl_emu.missions.registry import missions_of
from sitl_emu.run import report, run_command, score, worlds
from sitl_emu.run.launcher import Ending
from sitl_emu.run.messages import Over

HOME = (40.47, -86.99, 215.0, 0.0)
WEED, DISEASE, PUDDLE = (30.0, 20.0), (60.0, 50.0), (10.0, 70.0)
TRUTH = {
    "outline": [[0, 0], [0, 80], [80, 80], [80, 0]],
    "objects": [
        {"kind": "weed", "north_m": WEED[0], "east_m": WEED[1], "radius_m": 0.5, "target": True},
        {"kind": "disease", "north_m": DISEASE[0], "east_m": DISEASE[1], "radius_m": 0.7, "target": True},
        {"kind": "puddle", "north_m": PUDDLE[0], "east_m": PUDDLE[1], "radius_m": 0.7, "target": False},
    ],
}
MISSIONS = missions_of(["agriculture-scout", "agriculture-inspect"])
Line = dict[str, Any]


def place(north: float, east: float, prefix: str = "") -> dict[str, float]:
    lat, lon = MapProjection(HOME[0], HOME[1]).reproject(north, east)
    return {f"{prefix}lat_deg": lat, f"{prefix}lon_deg": lon}


def confirmed(number: int, where: tuple[float, float], label: str = "weed", by: str = "uas") -> Line:
    event = {"time_s": number, "vehicle": by, "event": "target_confirmed", "target": number}
    return event | {"label": label, "score": 0.8} | place(*where)


def inspected(where: tuple[float, float], label: str) -> Line:
    return {"time_s": 50, "vehicle": "ugv", "event": "inspected", "label": label} | place(*where)


def reported(number: int, result: str = "confirmed", label: str = "", by: str = "uas") -> Line:
    event = {"time_s": 60, "vehicle": by, "event": "report_received", "target": number}
    return event | {"result": result, "label": label}


def all_is_well() -> list[Line]:
    """Both targets found, and seen by the UGV."""
    return [
        confirmed(1, WEED, "weed"),
        confirmed(2, DISEASE, "disease"),
        inspected(WEED, "weed"),
        reported(1, "confirmed", "weed"),
        inspected(DISEASE, "disease"),
        reported(2, "confirmed", "disease"),
    ]


def write_run(folder: Path, events: list[Line], more: str = "") -> None:
    (folder / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events) + more)
    rows = [f"{t / 10:.2f},{29.0 + t / 100:.3f},20.000,-1.000,0,0,0,1,0,0,0" for t in range(100)]
    header = "time_s,north_m,east_m,down_m,vn_m_s,ve_m_s,vd_m_s,qw,qx,qy,qz"
    (folder / "truth-ugv.csv").write_text("\n".join([header, *rows]) + "\n" + more)


def summary(folder: Path, ended: str = "success") -> dict[str, Any]:
    return score.summary(folder, "agriculture", 7, Ending(ended, Over(ended), TRUTH, HOME), MISSIONS)


def counts(got: dict[str, Any]) -> tuple[int, ...]:
    """(confirmed, wrong labels, duplicates, false)."""
    return got["targets_confirmed"], got["wrong_labels"], got["duplicates"], got["false_confirmations"]


def test_a_run_in_which_everything_was_found_and_seen_is_a_success(tmp_path: Path) -> None:
    write_run(tmp_path, all_is_well())
    got = summary(tmp_path)
    assert (got["outcome"], score.exit_status(got), counts(got)) == ("success", 0, (2, 0, 0, 0))
    assert [row["inspection"] for row in got["targets"]] == ["confirmed", "confirmed"]
    assert got["targets_inspected"] == 2


def test_reports_are_matched_to_the_nearest_target_and_others_are_false(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(1, (30.3, 20.4)), confirmed(2, (60.0, 51.2), "disease"), confirmed(3, PUDDLE)])
    got = summary(tmp_path)
    assert counts(got) == (2, 0, 0, 1)
    assert [row["geolocation_error_m"] for row in got["targets"]] == pytest.approx([0.5, 1.2], abs=0.01)
    assert got["geolocation_rmse_m"] == pytest.approx(((0.5**2 + 1.2**2) / 2) ** 0.5, abs=0.01)


def test_a_target_that_nobody_reported_counts_as_missed(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(1, (30.0, 23.2))])
    got = summary(tmp_path)
    assert counts(got) == (0, 0, 0, 1)
    assert got["geolocation_rmse_m"] is None
    assert got["outcome"] == "2 of 2 targets not confirmed; 1 false target reported"


def test_a_weed_reported_as_disease_is_no_confirmation_and_has_its_own_count(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(1, WEED, "disease"), *all_is_well()[1:]])
    got = summary(tmp_path)
    assert counts(got) == (1, 1, 0, 0)
    assert (got["targets"][0]["confirmed"], got["targets"][0]["label"]) == (False, "disease")
    assert got["outcome"] == "1 of 2 targets not confirmed; 1 wrong label reported"


def test_a_second_report_of_a_target_is_a_duplicate_whoever_sends_it(tmp_path: Path) -> None:
    again = [confirmed(3, (31.0, 20.0)), confirmed(1, (29.0, 20.0), by="uas2")]
    write_run(tmp_path, [*all_is_well(), *again])
    got = summary(tmp_path)
    assert counts(got) == (2, 0, 2, 0)
    assert got["geolocation_rmse_m"] == pytest.approx(0.0, abs=0.001)
    assert got["outcome"] == "success"


def test_the_right_label_after_a_wrong_one_confirms_and_the_wrong_one_stays_counted(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(9, WEED, "disease"), *all_is_well()])
    got = summary(tmp_path)
    assert counts(got) == (2, 1, 0, 0)
    assert got["outcome"] == "1 wrong label reported" and score.exit_status(got) == 1


@pytest.mark.parametrize("result", ["not_seen", "not_reached", "pilot_took_over"])
def test_a_ugv_that_did_not_see_the_target_is_no_success(tmp_path: Path, result: str) -> None:
    write_run(tmp_path, [*all_is_well()[:-2], reported(2, result)])
    got = summary(tmp_path)
    assert [row["inspection"] for row in got["targets"]] == ["confirmed", result]
    assert (got["targets_confirmed"], got["targets_inspected"]) == (2, 1)
    assert got["outcome"] == f"target 2 (disease): UGV: {result.replace('_', ' ')}"


def test_a_ugv_that_sees_another_label_or_another_place_has_not_inspected_the_target(tmp_path: Path) -> None:
    first = all_is_well()[:-2]
    write_run(tmp_path, [*first, inspected(DISEASE, "weed"), reported(2, "confirmed", "weed")])
    assert summary(tmp_path)["targets"][1]["inspection"] == "wrong_label"
    write_run(tmp_path, [*first, inspected((60.0, 54.0), "disease"), reported(2, "confirmed", "disease")])
    assert summary(tmp_path)["targets"][1]["inspection"] == "not_seen"
    write_run(tmp_path, first)
    got = summary(tmp_path)
    assert got["targets"][1]["inspection"] is None
    assert got["outcome"] == "target 2 (disease): UGV: not inspected"


def test_what_cut_a_run_short_is_its_outcome(tmp_path: Path) -> None:
    write_run(tmp_path, all_is_well())
    got = summary(tmp_path, "time limit reached")
    assert (got["outcome"], score.exit_status(got)) == ("time limit reached", 1)


def test_stop_errors_compare_the_true_position_with_waypoint_and_target(tmp_path: Path) -> None:
    stopped = {"time_s": 5.0, "vehicle": "ugv", "event": "stopped", **place(0, 0), **place(29.2, 20.0, "waypoint_")}
    write_run(tmp_path, [confirmed(1, WEED), stopped])
    got = summary(tmp_path)
    assert got["ugv_stop_error_m"] == pytest.approx(0.3, abs=0.01)
    assert got["ugv_target_error_m"] == pytest.approx(0.5, abs=0.01)
    assert got["targets"][0]["ugv_stop_error_m"] == got["ugv_stop_error_m"]
    assert got["targets"][1]["ugv_stop_error_m"] is None


def test_the_ways_that_the_ugv_meant_to_drive_are_lines_on_the_map(tmp_path: Path) -> None:
    points = [place(0, 10), place(25, 10)]
    text = ", ".join(f"{point['lat_deg']:.7f} {point['lon_deg']:.7f}" for point in points)
    write_run(tmp_path, [{"time_s": 0.0, "vehicle": "ugv", "event": "way", "points": text}])
    got = summary(tmp_path)
    start = score.read_track(tmp_path, "ugv").at(0.0)
    (way,) = got["ugv_ways"]
    assert way["vehicle"] == "ugv" and way["places_m"][0] == pytest.approx(start, abs=0.01)
    assert way["places_m"][1:] == [pytest.approx((0, 10), abs=0.02), pytest.approx((25, 10), abs=0.02)]
    (line,) = agriculture_page(got).lines
    figure = report.draw_map(TRUTH, {}, [agriculture_page(got)], None)
    drawn = {one.get_label(): (one.get_xdata(), one.get_ydata()) for one in figure.axes[0].lines}
    east, north = (list(np.asarray(each)) for each in drawn[line.label])
    assert (north[-1], east[-1]) == pytest.approx((25, 10), abs=0.02)


def test_files_of_a_killed_run_end_within_a_line_and_are_read_all_the_same(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(1, WEED)], more='{"time_s": 9.1, "veh')
    assert summary(tmp_path)["targets_confirmed"] == 1
    assert len(score.read_track(tmp_path, "ugv").time_s) == 100


def test_a_run_without_truth_has_a_summary_all_the_same(tmp_path: Path) -> None:
    got = score.summary(tmp_path, "x", 1, Ending("the world process has gone"), MISSIONS)
    assert got["outcome"] == "the world process has gone" and got["targets"] == []
    assert score.lines(got) == []


def test_a_run_without_a_mission_of_ours_is_not_judged_by_targets(tmp_path: Path) -> None:
    write_run(tmp_path, [])
    got = score.summary(tmp_path, "own", 1, Ending("success", None, TRUTH, HOME))
    assert (got["outcome"], score.exit_status(got), "targets" in got) == ("success", 0, False)


def test_the_report_holds_everything_in_one_file(tmp_path: Path) -> None:
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames/one.jpg").write_bytes(b"\xff\xd8 picture")
    event = confirmed(1, WEED) | {"picture": "frames/one.jpg", "text": "weed <1>"}
    write_run(tmp_path, [event, *all_is_well()[1:]])
    got = summary(tmp_path)
    report.write(tmp_path, got, TRUTH, [agriculture_page(got)])
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/png;base64,") == 3 and page.count("data:image/jpeg;base64,") == 1
    assert "Outcome: success" in page and "weed &lt;1&gt;" in page
    assert "src='http" not in page and "frames/one.jpg" not in page


def test_missions_and_the_map_know_what_covers_the_ground(tmp_path: Path) -> None:
    water = {"kind": "water", "name": "pond", "label": "pond", "outline_m": [[0, 0], [9, 0], [9, 9]]}
    fire = {
        "kind": "fire", "name": "a", "label": "fire", "outline_m": [[20, 20], [30, 20], [30, 30]],
        "front_m_s": [0.5, 0.0], "burns_s": 60.0,
    }  # fmt: skip
    barrel = {"name": "b", "label": "barrel", "place_m": [5.0, 6.0, 0.2], "q": [1.0, 0.0, 0.0, 0.0]}
    truth = TRUTH | {"areas": [water, water | {"name": "other"}, fire], "loose": [barrel]}
    write_run(tmp_path, [])
    areas = score.record_of(tmp_path, Ending("success", None, truth, HOME)).areas
    assert [area.name for area in areas] == ["pond", "other", "a"] and tuple(areas[2].front_m_s) == (0.5, 0.0)
    (legend,) = report.draw_map(truth, {}, [], None).legends
    assert [text.get_text() for text in legend.get_texts()][:3] == ["pond", "fire", "barrel"]


# Outcome, exit status, counts and table are told of the same run, whatever happened in it

PLACES = st.sampled_from([WEED, DISEASE, PUDDLE]).flatmap(
    lambda at: st.tuples(st.floats(at[0] - 4, at[0] + 4), st.floats(at[1] - 4, at[1] + 4))
)
LABELS = st.sampled_from(["weed", "disease"])
FOUND = st.tuples(PLACES, LABELS, st.sampled_from(["uas", "uas2"]))
SEEN = st.tuples(PLACES, LABELS)
REPORTS = st.tuples(st.integers(1, 6), st.sampled_from(["confirmed", "not_seen", "not_reached"]), LABELS)
BROKEN = st.tuples(st.lists(FOUND, max_size=5), st.lists(SEEN, max_size=4), st.lists(REPORTS, max_size=4))


@settings(max_examples=150)
@given(
    broken=BROKEN,
    left_out=st.sets(st.integers(0, 5), max_size=2),
    ended=st.sampled_from(["success", "success", "success", "peer link lost"]),
)
def test_outcome_exit_status_counts_and_table_never_disagree(
    broken: tuple[list[Any], list[Any], list[Any]], left_out: set[int], ended: str
) -> None:
    found, seen, heard = broken
    events = [event for index, event in enumerate(all_is_well()) if index not in left_out]
    events += [confirmed(3 + index, where, label, by) for index, (where, label, by) in enumerate(found)]
    events += [inspected(where, label) for where, label in seen]
    events += [reported(number, result, label) for number, result, label in heard]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_run(folder, events)
        got = summary(folder, ended)
    rows = got["targets"]
    good = [row["confirmed"] and row["inspection"] == "confirmed" for row in rows]
    success = ended == "success" and all(good) and got["wrong_labels"] == got["false_confirmations"] == 0
    assert (got["outcome"] == "success") == success == (score.exit_status(got) == 0)
    assert sum(counts(got)) == len(got["reported"]) == sum(event["event"] == "target_confirmed" for event in events)
    assert got["targets_confirmed"] == sum(row["confirmed"] for row in rows) <= got["targets_total"] == len(rows)
    assert got["targets_inspected"] == sum(row["inspection"] == "confirmed" for row in rows)
    assert all(row["label"] == row["kind"] for row in rows if row["confirmed"])
    assert all(row["confirmed"] for row in rows if row["inspection"] is not None)
    told = re.search(r"targets: (\d+) of (\d+) confirmed, (\d+) inspected", " ".join(score.lines(got)))
    assert told is not None
    assert [int(number) for number in told.groups()] == [
        got["targets_confirmed"],
        got["targets_total"],
        got["targets_inspected"],
    ]


def test_a_mission_whose_score_or_page_fails_is_named_and_the_run_keeps_its_summary(tmp_path: Path) -> None:
    def broken(_: Any) -> Any:
        raise ZeroDivisionError("float division by zero")

    write_run(tmp_path, all_is_well())
    mission = Mission({"garden": Program(broken)}, score=broken, page=broken)
    got = score.summary(tmp_path, "garden", 1, Ending("success", None, TRUTH, HOME), [*MISSIONS, mission])
    assert got["outcome"] == "the score of garden failed: ZeroDivisionError: float division by zero"
    assert got["targets_confirmed"] == 2
    report.write(tmp_path, got, TRUTH, score.pages([*MISSIONS, mission], got))
    page = (tmp_path / "report.html").read_text()
    assert "<h2>Targets</h2>" in page and "<td>garden</td><td>ZeroDivisionError: float division by zero</td>" in page


def test_a_ground_that_cannot_be_drawn_is_told_and_the_report_is_written(tmp_path: Path) -> None:
    write_run(tmp_path, all_is_well())
    cv2.imwrite(str(tmp_path / "photo.png"), np.zeros((4, 4, 3), np.uint8))
    (tmp_path / "w.yaml").write_text("name: w\narea_m: [[0, 0], [0, 9], [9, 9]]\nground: {orthophoto: photo.png}\n")
    world = worlds.build(str(tmp_path / "w.yaml"), 1, {})
    (tmp_path / "photo.png").unlink()
    console = Console(file=io.StringIO(), width=80)
    run_command._report(tmp_path, summary(tmp_path), TRUTH, MISSIONS, world, console)
    told = console.file.getvalue()  # type: ignore[attr-defined]
    assert told.startswith("the report is without the ground's photo: ground.orthophoto: ") and told.count("\n") == 1
    assert (tmp_path / "report.html").is_file()


def test_the_report_draws_the_ground_under_each_vehicle(tmp_path: Path) -> None:
    write_run(tmp_path, all_is_well())
    under = list[tuple[float, float]]()

    def ground_m(north_m: float, east_m: float) -> float:
        under.append((north_m, east_m))
        return 2.0

    got = summary(tmp_path)
    report.write(tmp_path, got, TRUTH, [], ground_m=ground_m)
    tracks = [score.read_track(tmp_path, name) for name in ("uas", "ugv")]
    assert under == [place for track in tracks for place in zip(track.north_m, track.east_m, strict=True)]


def test_the_page_says_what_the_summary_says(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(1, WEED, "disease"), *all_is_well()[1:-1], reported(2, "not_seen")])
    got = summary(tmp_path)
    report.write(tmp_path, got, TRUTH, [agriculture_page(got)])
    page = (tmp_path / "report.html").read_text()
    assert f"<p class=failure><b>Outcome: {got['outcome']}</b>" in page
    assert "<td>weed</td><td>0.5</td><td>no</td><td>disease</td>" in page
    assert "<td>disease</td><td>0.7</td><td>yes</td><td>disease</td><td>0.8</td><td>not seen</td>" in page
