"""Truth against what the UAS reported and where its parcel lies: the figures of the disaster mission.

`truth.py` says what the true targets are: those count of which `LEAST_M2` or more lie in the area that was to be
scanned. Figures of summary.json, for campaigns and tables; None stands for what there was none of:

- `ending`: "delivered" (a parcel lies within 5 m of a true area, and safely), "misdelivered" (it lies elsewhere),
  "aborted" (it stayed on board for a reason), "nothing found", or "unfinished" (the flight did not end by itself);
  `abort_reason`: `aborts.Reason` of the last abort while a parcel was on board; `aborts`: all of them in order.
- `delivered`, `deliveries`: how many parcels lie well; of each: where it rests and was to lie (north, east),
  `to_target_m` (to the nearest true area's edge, 0 in it), `to_middle_m` (to the nearest middle of one), `to_place_m`
  (to where it was to lie, truly), `to_seen_m` (to where the vehicle's camera saw it lie), `target` (its index),
  `safe` and, where it is not, `unsafe` (in water, in the area, on a person or less than `TOO_NEAR_M` from one, on a
  roof, …).
- `targets_total`, `targets_found`, `targets`: each with label, true area, `found`, and `iou` of what was mapped of it
  with the truth, all within the scanned area; of a flood without what stands in it, under which nobody sees water.
- `regions_total`, `regions_false`: what was mapped, and of it what overlaps no true area of its label within 2 m.
- `diversions`, `diversions_false`: how often the line was left, and how often for an edge with no true area of that
  label within 5 m.
- `geolocation_rmse_m`: of the located edges of all others, against the nearest true edge, or of located middles
  (`as_printed.py`) against the nearest middle of a true area's bounds; `geolocation_within_2_sigma` the share within
  two of the sigmas that were stated.
- `sightings`, `sighting_rmse_m`: of each target the first place that a single frame gave it (`sightings.py`), against
  the middle of the true area's bounds.
- `alarms`: by how many frames in a row (`alarms.py`), how many places the detections alone would have called it to
  (`total`), and how many of them lie more than 5 m from any true area of that label (`false`).
- `scan_share`: of the lines, those flown to their end, by whomever; `coverage_s`: from the first arming to the last
  line's end, where all were flown.
- `served_twice`: parcels beyond the first that lie within 5 m of one true target; `separation_m`: how near two vehicles
  came to one another (`company.py`).
- `scan_height`: how high over the true ground or water the first vehicle scanned (`heights.py`).
- `terrain`: the map of the first vehicle that wrote one (`terrain.py`): `rms_m`, `bias_m`, `worst_m` against the true
  ground or water, where nothing stands, `known_share` of the area's cells, and the heights and errors for the report.

The mission is a success when a parcel was delivered, where there was a target, every line was flown, and no diversion
was false. A safe abort is no success, and says so by `ending`.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import shapely
from shapely import Geometry, Point, Polygon

from sitl_emu.missions.disaster import company
from sitl_emu.missions.disaster.aborts import DELIVERED_WITHIN_M
from sitl_emu.missions.disaster.heights import scan_height
from sitl_emu.missions.disaster.outlines import rings_of
from sitl_emu.missions.disaster.regions import LEAST_M2
from sitl_emu.missions.disaster.terrain import mapped_terrain
from sitl_emu.missions.disaster.truth import WATER, TrueTarget, joined, solids, targets
from sitl_emu.missions.scoring import EventLine, MissionScore, RunRecord

MATCH_M = 5.0
"""An edge that was located farther from any true one is none of it."""
SLACK_M = 2.0
"""A mapped region may lie so far beside what it is of: two cells."""
TOO_NEAR_M = 1.0
"""From a person's or a vehicle's outline; ours."""
APART_M = 5.0
"""As near as two vehicles may not come (issue 12)."""
LIVING_OR_DRIVING = ("person", "car", "truck", "fire engine", "van", "bus")
PLACES = 3


class Parcel(NamedTuple):
    """A parcel that was let go."""

    vehicle: str
    time_s: float
    north_m: float
    east_m: float
    to_place_m: float | None
    to_seen_m: float | None
    """None: the camera did not see it."""
    to_target_m: float | None
    target: int | None
    to_middle_m: float | None
    safe: bool
    unsafe: str


def score(record: RunRecord) -> MissionScore:
    """The figures of a run."""
    scanned = _scanned(record)
    true = [one for one in targets(record.areas, _end_s(record)) if one.shape.intersection(scanned).area >= LEAST_M2]
    mapped = _mapped(record)
    parcels = [_parcel(record, event) for event in record.events if event["event"] == "parcel at rest"]
    diversions = [_diversion(record, event) for event in record.events if event["event"] == "target_confirmed"]
    errors = [one["error_m"] for one in diversions if not one["false"]]
    aborted = [event["reason"] for event in record.events if event["event"] == "delivery_aborted"]
    delivered = [one for one in parcels if _is_delivered(one)]
    sightings = _sightings(record)
    standing = solids(record.areas)
    rows = [_row(one, mapped, scanned.difference(standing) if one.label == WATER else scanned) for one in true]
    figures: dict[str, Any] = {
        "ending": _ending(record, parcels, aborted),
        "abort_reason": aborted[-1] if aborted and not delivered else None,
        "aborts": aborted,
        "delivered": len(delivered),
        "deliveries": [{key: _rounded(value) for key, value in one._asdict().items()} for one in parcels],
        "targets_total": len(true),
        "targets_found": sum(row["found"] for row in rows),
        "targets": rows,
        "regions_total": len(mapped),
        "regions_false": sum(_is_false(one, true) for one in mapped),
        "regions": [{"label": label, "outlines_m": _corners(shape)} for label, shape in mapped],
        "diversions": len(diversions),
        "diversions_false": sum(one["false"] for one in diversions),
        "diverted": diversions,
        "geolocation_rmse_m": _rounded(_rms(errors)),
        "geolocation_within_2_sigma": _within_2_sigma(diversions),
        "sightings": sightings,
        "sighting_rmse_m": _rounded(_rms([one["error_m"] for one in sightings])),
        "alarms": _alarms(record),
        "scan_share": _scan_share(record),
        "coverage_s": _rounded(company.coverage_s(record.events)) if _scan_share(record) == 1.0 else None,
        "served_twice": company.served_twice([_served(record, one) for one in parcels]),
        "separation_m": _rounded(company.separation_m(record.tracks)),
        "scan_height": scan_height(record),
        "terrain": mapped_terrain(record),
        "area_m": _corners(scanned),
        "lines_m": _plan_lines(record),
    }
    return MissionScore(figures, _lines(figures), shortfalls(figures))


def shortfalls(figures: dict[str, Any]) -> list[str]:
    """What of these figures is no success."""
    told = []
    if figures["targets_total"] and not figures["delivered"]:
        aborted = figures["ending"] == "aborted"
        told.append("parcel not delivered" + (f": {figures['abort_reason']}" if aborted else f" ({figures['ending']})"))
    if figures["diversions_false"]:
        told.append(f"{figures['diversions_false']} false diversions")
    if figures["scan_share"] is not None and figures["scan_share"] < 1.0:
        told.append(f"{figures['scan_share']:.0%} of the lines were flown")
    if figures["served_twice"]:
        told.append(f"{figures['served_twice']} parcels for a target that had one")
    if figures["separation_m"] is not None and figures["separation_m"] < APART_M:
        told.append(f"two vehicles were {figures['separation_m']:.1f} m apart")
    return told


def _ending(record: RunRecord, parcels: Sequence[Parcel], aborted: Sequence[str]) -> str:
    if any(_is_delivered(one) for one in parcels):
        return "delivered"
    if parcels:
        return "misdelivered"
    if aborted:
        return "aborted"
    ended = any(event["event"] == "phase" and event.get("phase") == "landed" for event in record.events)
    return "nothing found" if ended else "unfinished"


def _is_delivered(one: Parcel) -> bool:
    return one.safe and one.to_target_m is not None and one.to_target_m <= DELIVERED_WITHIN_M


def _served(record: RunRecord, one: Parcel) -> int | None:
    """Which target, of those at the end, a parcel was for; None where it lies at none."""
    away = [(each.shape.distance(Point(one.north_m, one.east_m)), number)
            for number, each in enumerate(targets(record.areas, _end_s(record)))]  # fmt: skip
    near_m, number = min(away, default=(math.inf, None))
    return number if near_m <= DELIVERED_WITHIN_M else None


def _parcel(record: RunRecord, event: EventLine) -> Parcel:
    """Where a parcel came to rest, by the truth of that time."""
    place = Point(event["north_m"], event["east_m"])
    true = targets(record.areas, event["time_s"])
    away = [(one.shape.distance(place), number) for number, one in enumerate(true)]
    to_target_m, target = min(away, default=(None, None))
    released = [
        one for one in record.events
        if one["event"] == "released" and one["vehicle"] == event["vehicle"] and one["time_s"] <= event["time_s"]
    ]  # fmt: skip
    to_place_m = None
    if released:
        to_place_m = math.dist(_metres(record, released[-1], "place_"), (place.x, place.y))
    unsafe = _unsafe(record, event, place, to_target_m)
    return Parcel(
        event["vehicle"], event["time_s"], place.x, place.y, to_place_m, _to_seen_m(record, event, place),
        to_target_m, target, _to_middle_m(true, place), not unsafe, unsafe,
    )  # fmt: skip


def _to_middle_m(true: Sequence[TrueTarget], place: Point) -> float | None:
    """How far a place is from the nearest middle of a target's bounds; None where there is no target."""
    return min((float(one.shape.envelope.centroid.distance(place)) for one in true), default=None)


def _to_seen_m(record: RunRecord, event: EventLine, place: Point) -> float | None:
    """How far from where it lies the camera of its vehicle, which carries one, saw it."""
    told = [one for one in record.events if one["event"] == "parcel_seen" and one["vehicle"] == event["vehicle"]]
    return math.dist(_metres(record, told[0]), (place.x, place.y)) if told else None


def _unsafe(record: RunRecord, event: EventLine, place: Point, to_target_m: float | None) -> str:
    """What is wrong with where a parcel lies; "" if nothing."""
    if any(one["event"] == "parcel in water" and one["name"] == event["name"] for one in record.events):
        return "in water"
    if to_target_m == 0.0:
        return "in the area"
    for thing in record.objects:
        off_m = math.dist((thing.north_m, thing.east_m), (place.x, place.y)) - thing.radius_m
        if thing.kind in LIVING_OR_DRIVING and off_m < TOO_NEAR_M:
            return f"{off_m:.1f} m from a {thing.kind}" if off_m > 0.0 else f"on a {thing.kind}"
    return "on what stands there" if solids(record.areas).intersects(place) else ""


def _diversion(record: RunRecord, event: EventLine) -> dict[str, Any]:
    """A place that the line was left for, against the truth of that time."""
    north_m, east_m = _metres(record, event)
    place = Point(north_m, east_m)
    of_label = [one for one in targets(record.areas, event["time_s"]) if one.label == event["label"]]
    error_m = min((float(one.shape.boundary.distance(place)) for one in of_label), default=None)
    if event["located"] == "middle":
        error_m = _to_middle_m(of_label, place)
    away_m = min((float(one.shape.distance(place)) for one in of_label), default=math.inf)
    return {
        "vehicle": event["vehicle"],
        "time_s": event["time_s"],
        "label": event["label"],
        "located": event["located"],
        "north_m": _rounded(north_m),
        "east_m": _rounded(east_m),
        "error_m": _rounded(error_m),
        "sigma_m": event["sigma_m"],
        "false": away_m > MATCH_M,
    }


def _sightings(record: RunRecord) -> list[dict[str, Any]]:
    """What the first frame that was told of a target says, of each: off the middle of the target's bounds."""
    first = dict[tuple[str, int], dict[str, Any]]()
    for event in record.events:
        if event["event"] != "sighting":
            continue
        north_m, east_m = _metres(record, event)
        middles = [
            (math.dist((north_m, east_m), one.shape.envelope.centroid.coords[0]), number)
            for number, one in enumerate(targets(record.areas, event["time_s"]))
            if one.label == event["label"]
        ]
        if middles:
            error_m, number = min(middles)
            told = {"vehicle": event["vehicle"], "time_s": event["time_s"], "label": event["label"],
                    "north_m": _rounded(north_m), "east_m": _rounded(east_m), "error_m": _rounded(error_m)}  # fmt: skip
            first.setdefault((event["vehicle"], number), told)
    return list(first.values())


def _alarms(record: RunRecord) -> dict[str, dict[str, int]]:
    """By frames in a row, as text: JSON has no other keys."""
    counted = dict[str, dict[str, int]]()
    for event in record.events:
        if event["event"] != "alarms":
            continue
        count = counted.setdefault(str(event["frames"]), {"total": 0, "false": 0})
        (places,) = _rings(record, event["places"])
        for time_s, place in zip(map(float, event["times_s"].split()), places, strict=True):
            of_label = [one.shape for one in targets(record.areas, time_s) if one.label == event["label"]]
            count["total"] += 1
            count["false"] += all(shape.distance(Point(place)) > MATCH_M for shape in of_label)
    return counted


def _row(target: TrueTarget, mapped: Sequence[tuple[str, Geometry]], seen_of: Geometry) -> dict[str, Any]:
    """The line of one true target; `seen_of`: where what is there could be seen."""
    there = target.shape.intersection(seen_of)
    mine = [shape for label, shape in mapped if label == target.label and shape.intersects(target.shape)]
    seen = shapely.union_all(mine).intersection(seen_of)
    whole = float(there.union(seen).area)
    middle = there.centroid
    return {
        "label": target.label,
        "north_m": _rounded(float(middle.x)),
        "east_m": _rounded(float(middle.y)),
        "area_m2": _rounded(float(there.area)),
        "found": bool(mine),
        "iou": _rounded(float(there.intersection(seen).area) / whole) if whole else 0.0,
        "outlines_m": _corners(target.shape),
    }


def _mapped(record: RunRecord) -> list[tuple[str, Geometry]]:
    """The regions that were told at the end, as areas; of several vehicles those that are one as one."""
    told = [
        (event["label"], _area([ring for ring in _rings(record, event["outlines"]) if len(ring) >= 3]))
        for event in record.events
        if event["event"] == "region"
    ]
    if len({event["vehicle"] for event in record.events if event["event"] == "region"}) < 2:
        return told
    labels = sorted({label for label, _ in told})
    return [(label, shape) for label in labels for shape in joined([one for each, one in told if each == label])]


def _is_false(mapped: tuple[str, Geometry], true: Sequence[TrueTarget]) -> bool:
    label, shape = mapped
    return all(one.label != label or one.shape.distance(shape) > SLACK_M for one in true)


def _scanned(record: RunRecord) -> Geometry:
    """What was to be scanned."""
    areas = []
    for event in _plans(record):
        outline, *holes = _rings(record, event["area"])
        areas.append(Polygon(outline, holes))
    return shapely.union_all(areas)


def _plans(record: RunRecord) -> list[EventLine]:
    return [event for event in record.events if event["event"] == "plan"]


def _plan_lines(record: RunRecord) -> list[list[tuple[float, float]]]:
    """The lines of all plans; vehicles that share an area have the same, to the centimetre."""
    lines = dict[str, list[tuple[float, float]]]()
    for event in _plans(record):
        for line in _rings(record, event["lines"]):
            lines.setdefault(" ".join(f"{n:.1f} {e:.1f}" for n, e in line), line)
    return list(lines.values())


def _scan_share(record: RunRecord) -> float | None:
    lines = max((len(rings_of(event["lines"])) for event in _plans(record)), default=0)
    flown = {event["line"] for event in record.events if event["event"] == "line_scanned"}
    return _rounded(len(flown) / lines) if lines else None


def _rings(record: RunRecord, text: str) -> list[list[tuple[float, float]]]:
    return [[record.to_metres(*corner) for corner in ring] for ring in rings_of(text)]


def _area(rings: Sequence[Sequence[tuple[float, float]]]) -> Geometry:
    """Of rings along the middles of cells: half a cell more to all sides."""
    return shapely.union_all([Polygon(ring).buffer(0.0) for ring in rings]).buffer(0.5, quad_segs=2)


def _corners(shape: Geometry) -> list[list[list[float]]]:
    """The outlines of an area, as JSON has it: north and east, to the decimetre."""
    rings = []
    for part in shapely.get_parts(shape):
        if isinstance(part, Polygon) and not part.is_empty:
            rings += [part.exterior, *part.interiors]
    return [[[round(n, 1), round(e, 1)] for n, e in ring.coords] for ring in rings]


def _end_s(record: RunRecord) -> float:
    """When the parcel lay, else when the regions were told: the time that the truth of the whole is of."""
    told = [event["time_s"] for event in record.events if event["event"] in ("region", "parcel at rest")]
    return float(max(told, default=0.0))


def _metres(record: RunRecord, event: EventLine, prefix: str = "") -> tuple[float, float]:
    return record.to_metres(event[f"{prefix}lat_deg"], event[f"{prefix}lon_deg"])


def _rms(errors: Sequence[float]) -> float | None:
    return math.sqrt(math.fsum(error * error for error in errors) / len(errors)) if errors else None


def _within_2_sigma(diversions: Sequence[dict[str, Any]]) -> float | None:
    told = [one["error_m"] <= 2.0 * one["sigma_m"] for one in diversions if not one["false"]]
    return _rounded(sum(told) / len(told)) if told else None


def _lines(figures: dict[str, Any]) -> list[str]:
    """The figures for people."""
    told = [
        f"targets: {figures['targets_found']} of {figures['targets_total']} found; {figures['diversions']} diversions, "
        f"{figures['diversions_false']} false; location RMSE {_shown(figures['geolocation_rmse_m'])}"
    ]
    for one in figures["deliveries"]:
        lies = f"{_shown(one['to_target_m'])} from the area, {_shown(one['to_place_m'])} from its place"
        seen = "not seen there" if one["to_seen_m"] is None else f"seen {_shown(one['to_seen_m'])} from there"
        told.append(f"parcel of {one['vehicle']}: {lies}, {seen}; {'safe' if one['safe'] else one['unsafe']}")
    told += [f"aborted: {reason}" for reason in figures["aborts"]]
    if (terrain := figures["terrain"]) is not None and terrain["rms_m"] is not None:
        told.append(f"terrain: RMS error {terrain['rms_m']:.2f} m, {terrain['known_share']:.0%} of the area mapped")
    return told


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} m"


def _rounded(value: Any) -> Any:
    return round(value, PLACES) if isinstance(value, float) else value
