"""PX4's collision prevention in a run: a vehicle whose lidar or depth camera tells its autopilot of the wall."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

from tests.missions.installed import run_in_yard

WALL_NORTH_M, KEEP_M = 39.8, 4.0
OBSTACLE_AVOIDANCE, LASER, UNKNOWN, BODY_FRD = 196, 0, 4, 12
SENSORS: dict[str, dict[str, object]] = {
    "lidar": {"columns": 72, "rows": 16, "elevation_deg": [-30, 30], "rate_hz": 10},
    "depth": {"mount": {"forward_m": 0.1, "depression_deg": 0}, "resolution": [32, 24], "reach_m": 25, "rate_hz": 10},
}


def vehicle(**feeds: object) -> dict[str, object]:
    return {"name": "iris", "model": "iris", "start": "home", **feeds}


def track(folder: Path) -> dict[int, float]:
    """How far north it was, by the time in tenths of a second."""
    with (folder / "truth-iris.csv").open() as file:
        return {round(float(row["time_s"]) * 10): float(row["north_m"]) for row in csv.DictReader(file)}


def events(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]


def told_to_the_autopilot(folder: Path) -> list[Any]:
    """OBSTACLE_DISTANCE of its vehicle's sensor, from the payload link's log."""
    log, told = mavutil.mavlink_connection(str(folder / "iris-payload.tlog")), []
    while (message := log.recv_match(type="OBSTACLE_DISTANCE")) is not None:
        if message.get_srcComponent() == OBSTACLE_AVOIDANCE:
            told.append(message)
    log.close()
    return told


@pytest.mark.parametrize(
    ("feed", "kind", "nearest", "farthest"), [("lidar", LASER, 50, 4000), ("depth", UNKNOWN, 0, 2500)]
)
def test_a_full_stick_towards_a_wall_ends_cp_dist_before_it(
    tmp_path: Path, feed: str, kind: int, nearest: int, farthest: int
) -> None:
    folder = run_in_yard(tmp_path, "towards_the_wall", vehicle(**{feed: SENSORS[feed]}), {"keep_m": KEEP_M})
    north_m = track(folder)
    left_m = [WALL_NORTH_M - each for each in north_m.values()]
    assert min(left_m) > KEEP_M - 0.5, "the last metre is braked by the sensor's last scan"
    assert KEEP_M - 0.2 < left_m[-1] < KEEP_M + 1.0
    assert not [event for event in events(folder) if event["event"] in ("crashed", "touched")]
    at_wall = 0
    for message in told_to_the_autopilot(folder):
        assert (message.sensor_type, message.frame, message.increment_f) == (kind, BODY_FRD, 5.0)
        assert (message.min_distance, message.max_distance) == (nearest, farthest)
        truly_m = WALL_NORTH_M - north_m[round(message.time_usec / 1e5)]
        if truly_m < 10.0:
            at_wall += 1
            assert message.distances[0] == pytest.approx(truly_m * 100.0, abs=25.0)
    assert at_wall > 50


def test_without_a_sensor_it_does_not_move(tmp_path: Path) -> None:
    folder = run_in_yard(tmp_path, "towards_the_wall", vehicle(), {"keep_m": KEEP_M})
    assert any(event["event"] == "stick" for event in events(folder))
    assert max(track(folder).values()) < 1.5, "the wind alone"


def test_a_sensor_that_tells_the_autopilot_nothing_keeps_no_stick_from_the_wall(tmp_path: Path) -> None:
    silent = SENSORS["lidar"] | {"tells_obstacles": False}
    folder = run_in_yard(tmp_path, "towards_the_wall", vehicle(lidar=silent), {"keep_m": -1.0}, status=1)
    crash = next(event for event in events(folder) if event["event"] == "crashed")
    assert (crash["vehicle"], crash["other"]) == ("iris", "wall") and crash["speed_m_s"] > 5.0
    assert not told_to_the_autopilot(folder)
