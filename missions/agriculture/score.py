"""Truth against what scouts and UGV reported: the figures of the agriculture mission, counted strictly.

Every report of a scout (`target_confirmed`) is exactly one of four (`Verdict`): it *confirms* a true target if it is
the first to give its place, within `MATCH_M`, and its label; it is a *duplicate* if another did so before; it has a
*wrong label* if a target is there, but of another kind; it is *false* if none is there.

A confirmed target is *inspected* when the UGV's camera saw it where it is and gave its label too; else the row of the
table says what became of the UGV's job. Stop errors compare the UGV's true position, at the moment its companion says
that it stopped, with the waypoint it drove to and with the true target.

The mission is a success when every target is confirmed and inspected, nothing was reported falsely and no label was
wrong. A duplicate costs a drive at most; it has its own count and does not fail the mission.
"""

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import Any, NamedTuple

from sitl_emu.missions.agriculture.report import Result
from sitl_emu.missions.agriculture.ways import points_of
from sitl_emu.missions.scoring import EventLine, MissionScore, RunRecord, TrueObject

MATCH_M = 3.0
INSPECTED = Result.CONFIRMED.name.lower()
WRONG_LABEL = "wrong_label"


class Verdict(StrEnum):
    """What a report is worth."""

    CONFIRMED = "confirmed"
    WRONG_LABEL = WRONG_LABEL
    DUPLICATE = "duplicate"
    FALSE = "false"


class Reported(NamedTuple):
    """A target that a scout reported, and what the truth makes of it."""

    time_s: float
    vehicle: str
    number: int
    """The scout's own number of it."""
    label: str
    score: float
    north_m: float
    east_m: float
    verdict: Verdict
    target: int | None
    """Index of the true target that it belongs to."""
    error_m: float | None
    picture: str | None
    sigma_m: float | None
    """One sigma of the place, by the scout's own estimate."""


class Stop(NamedTuple):
    """Where a UGV stopped for a job, and the true target that the job's waypoint belongs to."""

    waypoint_error_m: float
    target: int | None
    target_error_m: float | None


def score(record: RunRecord) -> MissionScore:
    """The figures of a run."""
    targets = [thing for thing in record.objects if thing.target]
    found, stopped = judged(record, targets), stops(record, targets)
    rows = [_row(record, target, index, found, stopped) for index, target in enumerate(targets)]
    count = {verdict: sum(one.verdict is verdict for one in found) for verdict in Verdict}
    errors = [one.error_m for one in found if one.verdict is Verdict.CONFIRMED and one.error_m is not None]
    rmse = math.sqrt(sum(error * error for error in errors) / len(errors)) if errors else None
    figures = {
        "targets_total": len(rows),
        "targets_confirmed": count[Verdict.CONFIRMED],
        "targets_inspected": sum(row["inspection"] == INSPECTED for row in rows),
        "wrong_labels": count[Verdict.WRONG_LABEL],
        "duplicates": count[Verdict.DUPLICATE],
        "false_confirmations": count[Verdict.FALSE],
        "geolocation_rmse_m": _rounded(rmse),
        "geolocation_within_2_sigma": _within_2_sigma(found),
        "ugv_stop_error_m": _largest([stop.waypoint_error_m for stop in stopped]),
        "ugv_target_error_m": _largest([stop.target_error_m for stop in stopped]),
        "targets": rows,
        "ugv_ways": ways(record),
        "reported": [{key: _rounded(value) for key, value in one._asdict().items()} for one in found],
    }
    return MissionScore(figures, _lines(figures), shortfalls(figures))


def _within_2_sigma(found: Sequence[Reported]) -> float | None:
    """The share of confirmed targets within two of the sigmas that the scout gave them: whether these are honest."""
    told = [
        one.error_m <= 2.0 * one.sigma_m
        for one in found
        if one.verdict is Verdict.CONFIRMED and one.error_m is not None and one.sigma_m is not None
    ]
    return _rounded(sum(told) / len(told)) if told else None


def judged(record: RunRecord, targets: Sequence[TrueObject]) -> list[Reported]:
    """Every report of a target, in the order they came, with its verdict."""
    found = list[Reported]()
    confirmed = set[int]()
    for event in record.events:
        if event["event"] != "target_confirmed":
            continue
        place = record.to_metres(event["lat_deg"], event["lon_deg"])
        index = _nearest(targets, place, event["label"])
        if index is not None:
            verdict = Verdict.DUPLICATE if index in confirmed else Verdict.CONFIRMED
            confirmed.add(index)
        else:
            index = _nearest(targets, place, None)
            verdict = Verdict.FALSE if index is None else Verdict.WRONG_LABEL
        error = None if index is None else _away(targets[index], place)
        name, number, picture = event["vehicle"], event["target"], event.get("picture")
        sigma_m = event.get("sigma_m")
        found.append(
            Reported(
                event["time_s"],
                name,
                number,
                event["label"],
                event["score"],
                *place,
                verdict,
                index,
                error,
                picture,
                sigma_m,
            )
        )
    return found


def stops(record: RunRecord, targets: Sequence[TrueObject]) -> list[Stop]:
    """Where UGVs stopped for the waypoints they drove to, in order."""
    made = list[Stop]()
    for event in record.events:
        if event["event"] != "stopped" or event["vehicle"] not in record.tracks:
            continue
        place = record.tracks[event["vehicle"]].at(event["time_s"])
        waypoint = record.to_metres(event["waypoint_lat_deg"], event["waypoint_lon_deg"])
        index = _nearest(targets, waypoint, None)
        error = None if index is None else _away(targets[index], place)
        made.append(Stop(math.dist(place, waypoint), index, error))
    return made


def ways(record: RunRecord) -> list[dict[str, Any]]:
    """What each UGV meant to drive along, in order: from where it truly was, north and east in metres."""
    planned = list[dict[str, Any]]()
    for event in record.events:
        if event["event"] == "way" and event["vehicle"] in record.tracks:
            start = record.tracks[event["vehicle"]].at(event["time_s"])
            places = [start, *(record.to_metres(lat, lon) for lat, lon in points_of(event["points"]))]
            rounded = [[round(north, 2), round(east, 2)] for north, east in places]
            planned.append({"vehicle": event["vehicle"], "time_s": event["time_s"], "places_m": rounded})
    return planned


def shortfalls(figures: dict[str, Any]) -> list[str]:
    """What of these figures is no success."""
    rows = figures["targets"]
    missed = sum(not row["confirmed"] for row in rows)
    told = [f"{missed} of {len(rows)} targets not confirmed"] if missed else []
    for count, what in ((figures["wrong_labels"], "wrong label"), (figures["false_confirmations"], "false target")):
        told += [f"{count} {what}{'s' if count > 1 else ''} reported"] if count else []
    for number, row in enumerate(rows, 1):
        if row["confirmed"] and row["inspection"] != INSPECTED:
            became = (row["inspection"] or "not inspected").replace("_", " ")
            told.append(f"target {number} ({row['kind']}): UGV: {became}")
    return told


def _row(
    record: RunRecord, target: TrueObject, index: int, found: Sequence[Reported], stopped: Sequence[Stop]
) -> dict[str, Any]:
    """The line of one true target in the truth's table."""
    report = next((one for one in found if one.target == index and one.verdict is Verdict.CONFIRMED), None)
    wrong = next((one for one in found if one.target == index and one.verdict is Verdict.WRONG_LABEL), None)
    shown = report or wrong
    stop = next((one for one in stopped if one.target == index), None)
    return {
        **target._asdict(),
        "confirmed": report is not None,
        "label": shown.label if shown else None,
        "score": _rounded(shown.score) if shown else None,
        "geolocation_error_m": _rounded(report.error_m) if report else None,
        "inspection": _inspection(record, target, report) if report else None,
        "ugv_stop_error_m": _rounded(stop.waypoint_error_m) if stop else None,
        "ugv_target_error_m": _rounded(stop.target_error_m) if stop else None,
    }


def _inspection(record: RunRecord, target: TrueObject, report: Reported) -> str | None:
    """What became of the UGV's job for a confirmed target: a Result's name, or that it gave another label.

    The scout's "report_received" says what the UGV reported, the UGV's "inspected" where it saw what: a target that
    was reported as confirmed and was seen elsewhere was not seen.
    """
    mine = [event for event in record.events if _is_report_on(event, report)]
    if not mine:
        return None
    result: str = mine[-1]["result"]
    if result != INSPECTED:
        return result
    seen = [event["label"] for event in record.events if _is_sight_of(record, event, target, mine[-1]["time_s"])]
    if not seen:
        return Result.NOT_SEEN.name.lower()
    return INSPECTED if target.kind in seen and mine[-1]["label"] == target.kind else WRONG_LABEL


def _is_report_on(event: EventLine, report: Reported) -> bool:
    mine = event["event"] == "report_received" and event["vehicle"] == report.vehicle
    return bool(mine and event["target"] == report.number)


def _is_sight_of(record: RunRecord, event: EventLine, target: TrueObject, until_s: float) -> bool:
    if event["event"] != "inspected" or event["time_s"] > until_s:
        return False
    return _away(target, record.to_metres(event["lat_deg"], event["lon_deg"])) <= MATCH_M


def _nearest(targets: Sequence[TrueObject], place: tuple[float, float], label: str | None) -> int | None:
    """Index of the target nearest to a place, within MATCH_M; of a label's kind, None: of any."""
    near = [
        (away, index)
        for index, target in enumerate(targets)
        if (away := _away(target, place)) <= MATCH_M and label in (None, target.kind)
    ]
    return min(near)[1] if near else None


def _away(target: TrueObject, place: tuple[float, float]) -> float:
    return math.dist((target.north_m, target.east_m), place)


def _lines(figures: dict[str, Any]) -> list[str]:
    """The figures for people."""
    told = list[str]()
    total = figures["targets_total"]
    if total or figures["reported"]:
        told.append(
            f"targets: {figures['targets_confirmed']} of {total} confirmed, {figures['targets_inspected']} inspected "
            f"by the UGV; {figures['wrong_labels']} with a wrong label, {figures['false_confirmations']} false, "
            f"{figures['duplicates']} twice; geolocation RMSE {_metres(figures['geolocation_rmse_m'])}"
        )
    if figures["ugv_stop_error_m"] is not None:
        told.append(
            f"UGV: stopped at most {_metres(figures['ugv_stop_error_m'])} from the waypoint it drove to, "
            f"{_metres(figures['ugv_target_error_m'])} from the true target"
        )
    return told


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} m"


def _largest(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return _rounded(max(known)) if known else None


def _rounded(value: Any) -> Any:
    return round(value, 3) if isinstance(value, float) else value
