"""Scoring: what belongs to which target, what counts as false, and that files of a killed run can be read."""

import json
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.run import report, score
from sitl_emu.run.launcher import Ending

HOME = [40.47, -86.99, 215.0, 0.0]
TRUTH = {
    "outline": [[0, 0], [0, 80], [80, 80], [80, 0]],
    "objects": [
        {"kind": "weed", "north_m": 30.0, "east_m": 20.0, "radius_m": 0.5, "target": True},
        {"kind": "disease", "north_m": 60.0, "east_m": 50.0, "radius_m": 0.7, "target": True},
        {"kind": "puddle", "north_m": 10.0, "east_m": 70.0, "radius_m": 0.7, "target": False},
    ],
}


def place(north: float, east: float, prefix: str = "") -> dict[str, float]:
    lat, lon = MapProjection(HOME[0], HOME[1]).reproject(north, east)
    return {f"{prefix}lat_deg": lat, f"{prefix}lon_deg": lon}


def confirmed(time_s: float, north: float, east: float, label: str = "weed") -> dict[str, Any]:
    event = {"time_s": time_s, "vehicle": "uas", "event": "target_confirmed", "label": label, "score": 0.8}
    return event | place(north, east)


def write_run(folder: Path, events: list[dict[str, Any]], more: str = "") -> None:
    (folder / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events) + more)
    rows = [f"{t / 10:.2f},{29.0 + t / 100:.3f},20.000,-1.000,0,0,0,1,0,0,0" for t in range(100)]
    header = "time_s,north_m,east_m,down_m,vn_m_s,ve_m_s,vd_m_s,qw,qx,qy,qz"
    (folder / "truth-ugv.csv").write_text("\n".join([header, *rows]) + "\n" + more)


def summary(folder: Path) -> dict[str, Any]:
    return score.summary(folder, "agriculture", 7, Ending("success", {"frames_dropped": 0}, TRUTH, HOME))


def test_reports_are_matched_to_the_nearest_target_and_others_are_false(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(1, 30.3, 20.4), confirmed(2, 60.0, 51.2, "disease"), confirmed(3, 10.0, 70.0)])
    got = summary(tmp_path)
    assert (got["targets_total"], got["targets_confirmed"], got["false_confirmations"]) == (2, 2, 1)
    assert [row["geolocation_error_m"] for row in got["targets"]] == pytest.approx([0.5, 1.2], abs=0.01)
    assert got["geolocation_rmse_m"] == pytest.approx(((0.5**2 + 1.2**2) / 2) ** 0.5, abs=0.01)


def test_a_target_that_nobody_reported_counts_as_missed(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(1, 30.0, 23.2)])
    got = summary(tmp_path)
    assert (got["targets_confirmed"], got["false_confirmations"], got["geolocation_rmse_m"]) == (0, 1, None)


def test_stop_errors_compare_the_true_position_with_waypoint_and_target(tmp_path: Path) -> None:
    stopped = {"time_s": 5.0, "vehicle": "ugv", "event": "stopped", **place(0, 0), **place(29.2, 20.0, "waypoint_")}
    write_run(tmp_path, [confirmed(1, 30.0, 20.0), stopped])
    got = summary(tmp_path)
    assert got["ugv_stop_error_m"] == pytest.approx(0.3, abs=0.01)
    assert got["ugv_target_error_m"] == pytest.approx(0.5, abs=0.01)
    assert got["targets"][0]["ugv_stop_error_m"] == got["ugv_stop_error_m"]
    assert got["targets"][1]["ugv_stop_error_m"] is None


def test_files_of_a_killed_run_end_within_a_line_and_are_read_all_the_same(tmp_path: Path) -> None:
    write_run(tmp_path, [confirmed(1, 30.0, 20.0)], more='{"time_s": 9.1, "veh')
    assert summary(tmp_path)["targets_confirmed"] == 1
    assert len(score.read_track(tmp_path, "ugv").time_s) == 100


def test_a_run_without_truth_has_a_summary_all_the_same(tmp_path: Path) -> None:
    got = score.summary(tmp_path, "x", 1, Ending("the world process has gone"))
    assert got["outcome"] == "the world process has gone" and got["targets_total"] == 0
    assert score.lines(got) == []


def test_the_report_holds_everything_in_one_file(tmp_path: Path) -> None:
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames/one.jpg").write_bytes(b"\xff\xd8 picture")
    event = confirmed(1, 30.0, 20.0) | {"picture": "frames/one.jpg", "text": "weed <1>"}
    write_run(tmp_path, [event])
    report.write(tmp_path, summary(tmp_path), TRUTH)
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/png;base64,") == 3 and page.count("data:image/jpeg;base64,") == 1
    assert "Outcome: success" in page and "weed &lt;1&gt;" in page
    assert "src='http" not in page and "frames/one.jpg" not in page
