"""How a run ended: the figures of summary.json, and its one outcome.

What a mission's figures are, the mission itself knows (`missions/scoring.py`); here is what all runs have in common,
and the one place that says whether a run was a success: summary.json, report.html, the text on the terminal and the
exit status all tell what `summary` derived. Nothing here looks at the clock; what depends on the machine is kept apart
under `wall_clock`.
"""

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.missions.companion.companion import Status
from sitl_emu.missions.mission import Figures, Mission
from sitl_emu.missions.reporting import Page, Section, Table
from sitl_emu.missions.scoring import MissionScore, RunRecord, Track, TrueArea, TrueObject, together
from sitl_emu.run.launcher import Ending
from sitl_emu.run.messages import Over
from sitl_emu.world.labels.geojson import footprint
from sitl_emu.world.world import World

SUCCESS = "success"
EXIT_SUCCESS, EXIT_FAILED = 0, 1


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


def record_of(folder: Path, ending: Ending, world: World | None = None) -> RunRecord:
    """What a run left, for its missions' score; a run whose world never stood has no truth and no events.

    `world`: tells the ground's height, and what stands on it.
    """
    names = [path.stem.removeprefix("truth-") for path in sorted(folder.glob("truth-*.csv"))]
    tracks = {name: track for name in names if (track := read_track(folder, name)).time_s}
    objects = [TrueObject(**thing) for thing in ending.truth.get("objects", [])]
    areas = [TrueArea(**area) for area in ending.truth.get("areas", [])]
    if world is not None:
        solids = world.description.solids
        areas += [TrueArea("solid", solid.name, solid.label, footprint(solid, world)) for solid in solids]
    lat0_deg, lon0_deg = ending.home[:2] or (0.0, 0.0)
    project = MapProjection(lat0_deg, lon0_deg).project
    ground_m = world.ground if world is not None else None
    amsl_m = ending.home[2] if ending.home else 0.0
    return RunRecord(read_events(folder), objects, tracks, project, areas, ground_m, folder, amsl_m)


def _scored(mission: Mission, record: RunRecord) -> MissionScore | None:
    """A mission's score; one that can't be computed keeps the run from being a success, and from nothing else."""
    if mission.score is None:
        return None
    try:
        return mission.score(record)
    except Exception as error:  # whatever a foreign package's arithmetic does
        return MissionScore({}, [], [f"the score of {'/'.join(mission.programs)} failed: {_said(error)}"])


def pages(missions: Sequence[Mission], figures: Figures) -> list[Page]:
    """What the missions add to the report; one whose page can't be made says so there."""
    made = list[Page]()
    for mission in missions:
        try:
            made += [mission.page(figures)] if mission.page is not None else []
        except Exception as error:
            row = ("/".join(mission.programs), _said(error))
            made.append(Page([Section("A page that could not be made", [Table(("mission", "why"), [row])])]))
    return made


def _said(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


def outcome_of(ended: str, score: MissionScore | None) -> str:
    """The outcome of a run: "success", or what failed.

    `ended` is how it ended by what its companions said, or what cut it short; where that is a success, the truth may
    still say otherwise.
    """
    if ended != SUCCESS or score is None:
        return ended or "unknown"
    return "; ".join(score.shortfalls) or SUCCESS


def summary(
    folder: Path,
    scenario: str,
    seed: int,
    ending: Ending,
    missions: Sequence[Mission] = (),
    world: World | None = None,
) -> dict[str, Any]:
    """The contents of summary.json. `missions`: those whose programs the run's companions ran, in this `world`."""
    over = ending.over or Over(ending.outcome)
    figures = over.figures
    record = record_of(folder, ending, world)
    score = together([scored for one in missions if (scored := _scored(one, record)) is not None])
    return {
        "scenario": scenario,
        "seed": seed,
        "outcome": outcome_of(ending.outcome, score),
        **(score.figures if score is not None else {}),
        "lines": score.lines if score is not None else [],
        "frames_rendered": figures.frames_rendered if figures else None,
        "frames_dropped": figures.frames_dropped if figures else None,
        "simulated_s": figures.simulated_s if figures else None,
        "radio": {name: counts._asdict() for name, counts in figures.radio.items()} if figures else {},
        "armed_at_end": list(figures.armed_at_end) if figures else [],
        "companions": _statuses(figures.companions) if figures else {},
        "faults": list(over.faults),
        "faults_left": list(over.faults_left),
        "speed_factor": _rounded(figures.speed_factor if figures else None),
        "wall_clock": {"run_s": _rounded(figures.wall_s if figures else None)},
    }


def _statuses(companions: Mapping[str, Status | None]) -> dict[str, dict[str, Any]]:
    return {name: status._asdict() if status else {} for name, status in companions.items()}


WALL_CLOCK_KEYS = ("speed_factor", "wall_clock")
"""What of a summary depends on the machine."""


def exit_status(summary: dict[str, Any]) -> int:
    """The exit status of a run with this summary."""
    return EXIT_SUCCESS if summary["outcome"] == SUCCESS else EXIT_FAILED


def lines(summary: dict[str, Any]) -> list[str]:
    """The figures for people."""
    told = list[str](summary["lines"])
    told += [f"injected fault: {fault}" for fault in summary["faults"]]
    told += [f"fault not injected, as its event did not come: {fault}" for fault in summary["faults_left"]]
    if summary["speed_factor"] is not None:
        told.append(
            f"{summary['simulated_s']:.0f} s simulated, {summary['speed_factor']:.1f} x real time from arming to "
            f"disarming; {summary['frames_rendered']} frames, {summary['frames_dropped']} dropped"
        )
    return told


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)


def details(summary: dict[str, Any]) -> list[str]:
    """What a companion has counted, for whoever looks closer."""
    counted = {
        vehicle: [f"{count} {what}" for what, count in status.get("counts", {}).items() if count]
        for vehicle, status in summary["companions"].items()
    }
    return [f"{vehicle}: {'; '.join(counts)}" for vehicle, counts in counted.items() if counts]
