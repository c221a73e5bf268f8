"""Depth and points in a run, from the world's rays to a companion in lockstep, against the truth at their time."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from sitl_emu.missions.companion import calibration
from sitl_emu.missions.companion.camera_model import body_points, camera_pose, depth_points
from tests.missions.installed import run_in_yard
from tests.typed import present

ROOF_M, WALL_NORTH_M = 4.0, 39.8
WITHIN_M = 0.1
VEHICLE: dict[str, object] = {
    "name": "iris",
    "model": "iris",
    "start": "home",
    "depth": {"reach_m": 20, "resolution": [32, 24], "mount": {"down_m": 0.1, "depression_deg": 80}},
    "lidar": {"columns": 360, "rows": 24, "elevation_deg": [-70, -20], "latency_s": 0.2},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of `measure_house`."""
    made = tmp_path_factory.mktemp("feeds")
    run_in_yard(made, "measure_house", VEHICLE)
    return made


def truths(folder: Path) -> dict[int, tuple[tuple[float, float, float], Any]]:
    """Where the vehicle truly was (NED), and its attitude, by the time in µs."""
    with (folder / "run/truth-iris.csv").open() as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    return {
        round(row["time_s"] * 1e6): (
            (row["north_m"], row["east_m"], row["down_m"]),
            (row["qw"], row["qx"], row["qy"], row["qz"]),
        )
        for row in rows
    }


def test_depth_over_a_roof_agrees_with_the_truth(folder: Path) -> None:
    depths, truth = np.load(folder / "depths.npz"), truths(folder)
    assert len(depths.files) > 10, "5 a second for 3 s"
    camera = calibration.read(folder / "run/iris-depth.yaml")
    for time_us in depths.files:
        pose = camera_pose(*truth[int(time_us)], present(camera.mount))
        seen = depth_points(camera.camera, pose, depths[time_us]).reshape(-1, 3)
        inner = (np.abs(seen[:, 0] - 25.0) < 4.5) & (np.abs(seen[:, 1] - 10.0) < 5.5) & (-seen[:, 2] > 2.0)
        heights = -seen[inner, 2]
        assert len(heights) > 100
        assert abs(heights.mean() - ROOF_M) < 0.02 and np.abs(heights - ROOF_M).max() < WITHIN_M


def test_a_scan_hits_the_wall_and_the_roof_at_their_places(folder: Path) -> None:
    clouds, truth = np.load(folder / "clouds.npz"), truths(folder)
    assert len(clouds.files) > 10
    walls = 0
    for time_us in clouds.files:
        seen = body_points(*truth[int(time_us)], clouds[time_us])
        north, east, up = seen[:, 0], seen[:, 1], -seen[:, 2]
        wall = (np.abs(north - WALL_NORTH_M) < 0.5) & (up > 0.3) & (up < 2.3) & (np.abs(east) < 14.5)
        walls += wall.sum()
        assert np.abs(north[wall] - WALL_NORTH_M).max(initial=0.0) < 0.15, "five sigma of 3 cm"
        roof = (np.abs(north - 25.0) < 4.5) & (np.abs(east - 10.0) < 5.5) & (up > 2.0)
        assert roof.sum() > 1000 and abs(up[roof].mean() - ROOF_M) < 0.01
        assert np.abs(up[roof] - ROOF_M).max() < 0.15, "five sigma"
    assert walls > 10 * len(clouds.files)


def test_the_runs_folder_says_that_all_arrived(folder: Path) -> None:
    events = (folder / "run/events.jsonl").read_text()
    assert '"event": "measured"' in events
    summary = yaml.safe_load((folder / "run/summary.json").read_text())
    assert summary["outcome"] == "success" and summary["frames_dropped"] == 0
    assert not [path.name for path in Path("/dev/shm").iterdir() if "iris-depth" in path.name]
