"""Truth against what the companions reported: the figures of summary.json.

A reported target belongs to the nearest true one within `MATCH_M`; what has none is a false confirmation. Stop errors
compare the UGV's true position, at the moment its companion says that it stopped, with the waypoint it was sent and
with the true target. Nothing here looks at the clock; what depends on the machine is kept apart under `wall_clock`.
"""

import csv
import json
import math
from bisect import bisect_left
from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.run.launcher import Ending

MATCH_M = 3.0


class Track(NamedTuple):
    """A vehicle's true path: columns over time."""

    time_s: list[float]
    north_m: list[float]
    east_m: list[float]
    up_m: list[float]

    def at(self, time_s: float) -> tuple[float, float]:
        """(north_m, east_m) at a time."""
        i = min(max(bisect_left(self.time_s, time_s), 0), len(self.time_s) - 1)
        return self.north_m[i], self.east_m[i]


class Reported(NamedTuple):
    """A target that a companion confirmed, and the true one it belongs to (index, or None)."""

    time_s: float
    label: str
    score: float
    north_m: float
    east_m: float
    target: int | None
    error_m: float | None
    picture: str | None


class Stop(NamedTuple):
    """Where the UGV stopped for a waypoint."""

    time_s: float
    north_m: float
    east_m: float
    waypoint_error_m: float
    target: int | None
    target_error_m: float | None


def read_track(folder: Path, vehicle: str) -> Track:
    """The true path of a vehicle of a run."""
    track = Track([], [], [], [])
    path = folder / f"truth-{vehicle}.csv"
    if path.is_file():
        with path.open() as file:
            for row in csv.DictReader(file):
                if row["down_m"] is None or row["qz"] is None:
                    break  # a run that was killed ends within a line
                track.time_s.append(float(row["time_s"]))
                track.north_m.append(float(row["north_m"]))
                track.east_m.append(float(row["east_m"]))
                track.up_m.append(-float(row["down_m"]))
    return track


def read_events(folder: Path) -> list[dict[str, Any]]:
    """The events of a run, in order."""
    path = folder / "events.jsonl"
    events = list[dict[str, Any]]()
    for line in path.read_text().splitlines() if path.is_file() else []:
        try:
            events.append(json.loads(line))
        except ValueError:
            break  # a run that was killed ends within a line
    return events


def true_targets(truth: dict[str, Any]) -> list[dict[str, Any]]:
    """The objects to be found."""
    return [thing for thing in truth.get("objects", []) if thing["target"]]


def reported(events: list[dict[str, Any]], truth: dict[str, Any], home: list[float]) -> list[Reported]:
    """What was confirmed, each with the true target that it belongs to."""
    targets, found = true_targets(truth), list[Reported]()
    for event in events:
        if event["event"] == "target_confirmed":
            north, east = MapProjection(home[0], home[1]).project(event["lat_deg"], event["lon_deg"])
            index, error = _nearest(targets, north, east)
            found.append(
                Reported(
                    event["time_s"], event["label"], event["score"], north, east, index, error, event.get("picture")
                )
            )
    return found


def stops(folder: Path, events: list[dict[str, Any]], truth: dict[str, Any], home: list[float]) -> list[Stop]:
    """Where vehicles stopped for the waypoints they were sent."""
    targets, tracks, made = true_targets(truth), dict[str, Track](), list[Stop]()
    for event in events:
        if event["event"] == "stopped" and "waypoint_lat_deg" in event:
            name = event["vehicle"]
            track = tracks[name] = tracks.get(name) or read_track(folder, name)
            if not track.time_s:
                continue
            north, east = track.at(event["time_s"])
            wanted = MapProjection(home[0], home[1]).project(event["waypoint_lat_deg"], event["waypoint_lon_deg"])
            index, _ = _nearest(targets, *wanted)
            error = None
            if index is not None:
                error = math.dist((north, east), (targets[index]["north_m"], targets[index]["east_m"]))
            made.append(Stop(event["time_s"], north, east, math.dist((north, east), wanted), index, error))
    return made


def _nearest(targets: list[dict[str, Any]], north: float, east: float) -> tuple[int | None, float | None]:
    """(index, distance) of the true target within MATCH_M, or Nones."""
    distances = [math.dist((north, east), (target["north_m"], target["east_m"])) for target in targets]
    if not distances or min(distances) > MATCH_M:
        return None, None
    index = distances.index(min(distances))
    return index, distances[index]


def summary(folder: Path, scenario: str, seed: int, ending: Ending) -> dict[str, Any]:
    """The contents of summary.json."""
    events, figures = read_events(folder), ending.figures
    found = reported(events, ending.truth, ending.home) if ending.home else []
    stopped = stops(folder, events, ending.truth, ending.home) if ending.home else []
    errors = [one.error_m for one in found if one.error_m is not None]
    rows = list[dict[str, Any]]()
    for index, target in enumerate(true_targets(ending.truth)):
        mine = [one for one in found if one.target == index]
        stop = next((one for one in stopped if one.target == index), None)
        rows.append(
            {
                **target,
                "confirmed": bool(mine),
                "label": mine[0].label if mine else None,
                "score": _rounded(mine[0].score) if mine else None,
                "geolocation_error_m": _rounded(mine[0].error_m) if mine else None,
                "ugv_stop_error_m": _rounded(stop.waypoint_error_m) if stop else None,
                "ugv_target_error_m": _rounded(stop.target_error_m) if stop else None,
            }
        )
    return {
        "scenario": scenario,
        "seed": seed,
        "outcome": ending.outcome or "unknown",
        "geolocation_rmse_m": _rounded(math.sqrt(sum(e * e for e in errors) / len(errors))) if errors else None,
        "ugv_stop_error_m": _largest([stop.waypoint_error_m for stop in stopped]),
        "ugv_target_error_m": _largest([stop.target_error_m for stop in stopped]),
        "targets_total": len(rows),
        "targets_confirmed": sum(row["confirmed"] for row in rows),
        "false_confirmations": sum(one.target is None for one in found),
        "targets": rows,
        "reported": [{key: _plain(value) for key, value in one._asdict().items()} for one in found],
        "frames_rendered": figures.get("frames_rendered"),
        "frames_dropped": figures.get("frames_dropped"),
        "simulated_s": figures.get("simulated_s"),
        "radio": figures.get("radio", {}),
        "armed_at_end": figures.get("armed_at_end", []),
        "companions": figures.get("companions", {}),
        "speed_factor": _rounded(figures.get("speed_factor")),
        "wall_clock": {"run_s": _rounded(figures.get("wall_s"))},
    }


WALL_CLOCK_KEYS = ("speed_factor", "wall_clock")
"""What of a summary depends on the machine."""


def lines(summary: dict[str, Any]) -> list[str]:
    """The figures for people."""
    told = list[str]()
    if summary["targets_total"]:
        false = summary["false_confirmations"]
        told.append(
            f"targets: {summary['targets_confirmed']} of {summary['targets_total']} confirmed, {false} false; "
            f"geolocation RMSE {_metres(summary['geolocation_rmse_m'])}"
        )
    if summary["ugv_stop_error_m"] is not None:
        told.append(
            f"UGV: stopped at most {_metres(summary['ugv_stop_error_m'])} from the waypoint it was sent, "
            f"{_metres(summary['ugv_target_error_m'])} from the true target"
        )
    if summary["speed_factor"] is not None:
        told.append(
            f"{summary['simulated_s']:.0f} s simulated, {summary['speed_factor']:.1f} x real time from arming to "
            f"disarming; {summary['frames_rendered']} frames, {summary['frames_dropped']} dropped"
        )
    return told


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} m"


def _plain(value: float | int | str | None) -> float | int | str | None:
    return round(value, 3) if isinstance(value, float) else value


def _largest(values: list[float | None] | list[float]) -> float | None:
    known = [value for value in values if value is not None]
    return _rounded(max(known)) if known else None


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
