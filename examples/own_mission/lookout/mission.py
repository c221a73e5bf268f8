"""What the package brings: the program of its companion, its options, its scenario, its score and its report page."""

import math
from pathlib import Path

from lookout.flight import look_out
from sitl_emu.companion import Companion, Scripted
from sitl_emu.mission import Figures, Mission, MissionScore, Options, Page, Program, RunRecord, Section, Table

HEIGHT_WITHIN_M = 1.0
PLACE_WITHIN_M = 2.0


def lookout(options: Options) -> Companion:
    """The companion; a scenario's `options` are `height_m` and `wait_s`."""
    height_m = options.number("height_m", 8.0, low=2.0, high=100.0)
    wait_s = options.number("wait_s", 10.0, low=1.0, high=600.0)
    return Scripted(lambda onboard: look_out(onboard, height_m, wait_s))


def score(record: RunRecord) -> MissionScore:
    """By the truth: how high every lookout was, and how far from where it had begun."""
    rows = [row for vehicle in record.tracks if (row := _lookout(record, vehicle)) is not None]
    wrong = [f"{row['vehicle']}: {row['height_error_m']:.1f} m off its height" for row in rows if not _is_good(row)]
    lines = [f"{row['vehicle']} looked out within {row['height_error_m']:.2f} m of its height" for row in rows]
    return MissionScore({"lookouts": rows}, lines, wrong or ([] if rows else ["nobody looked out"]))


def _lookout(record: RunRecord, vehicle: str) -> dict[str, float | str] | None:
    """The largest errors of one vehicle's lookout; None if there was none."""
    mine = {event["event"]: event for event in record.events if event["vehicle"] == vehicle}
    if not {"lookout_begins", "lookout_ends"} <= mine.keys():
        return None
    begin, end = mine["lookout_begins"], mine["lookout_ends"]
    track = record.tracks[vehicle]
    during = [index for index, time_s in enumerate(track.time_s) if begin["time_s"] <= time_s <= end["time_s"]]
    start = track.north_m[0], track.east_m[0]
    return {
        "vehicle": vehicle,
        "height_error_m": round(max(abs(track.up_m[i] - track.up_m[0] - begin["height_m"]) for i in during), 3),
        "drift_m": round(max(math.dist(start, (track.north_m[i], track.east_m[i])) for i in during), 3),
    }


def _is_good(row: dict[str, float | str]) -> bool:
    return float(row["height_error_m"]) < HEIGHT_WITHIN_M and float(row["drift_m"]) < PLACE_WITHIN_M


def page(figures: Figures) -> Page:
    """A table in report.html."""
    rows = [(row["vehicle"], row["height_error_m"], row["drift_m"]) for row in figures["lookouts"]]
    return Page([Section("Lookouts", [Table(("vehicle", "height error, m", "drift, m"), rows)])])


MISSION = Mission(
    programs={"lookout": Program(lookout)},
    scenarios=Path(__file__).with_name("scenarios"),
    score=score,
    page=page,
)
