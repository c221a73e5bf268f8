"""What the disaster mission adds to a run's report: targets and parcels as tables, and on the map what was flown."""

from collections.abc import Mapping, Sequence
from typing import Any

from sitl_emu.missions.mission import Figures
from sitl_emu.missions.reporting import Line, Mark, Page, Section, Table

COLOURS = {"water_body": "#1565c0", "debris_field": "#6d4c41", "fire_region": "#d84315"}
"""Of areas on the map."""
THINGS = {"person": "#ad1457", "car": "#5e35b1", "truck": "#4527a0"}
AREA_COLOUR, LINE_COLOUR, PARCEL_COLOUR, PLACE_COLOUR = "#263238", "#90a4ae", "#00c853", "#d50000"


def page(figures: Figures) -> Page:
    """From the figures of its score (`score.py`)."""
    marks = [Mark(one["north_m"], one["east_m"], "located edge", PLACE_COLOUR) for one in figures["diverted"]]
    marks += [
        Mark(one["north_m"], one["east_m"], "parcel at rest", PARCEL_COLOUR, "P") for one in figures["deliveries"]
    ]
    lines = [Line(ring, "area to scan", AREA_COLOUR, "-") for ring in figures["area_m"]]
    lines += [Line(line, "scan line", LINE_COLOUR, ":") for line in figures["lines_m"]]
    for what, style, areas in (("true", "-", figures["targets"]), ("mapped", "--", figures["regions"])):
        lines += [
            Line(ring, f"{what} {area['label']}", COLOURS.get(area["label"], AREA_COLOUR), style)
            for area in areas
            for ring in area["outlines_m"]
        ]
    sections = [Section("Delivery", [_delivery(figures), _parcels(figures["deliveries"])])]
    sections.append(Section("Targets", [_targets(figures["targets"]), _diversions(figures["diverted"])]))
    return Page(sections, marks, THINGS, lines)


def _delivery(figures: Figures) -> Table:
    rows: list[tuple[object, ...]] = [
        ("ending", figures["ending"]),
        ("reason of the abort", figures["abort_reason"]),
        ("all aborts", ", ".join(figures["aborts"]) or None),
        ("diversions", figures["diversions"]),
        ("of these false", figures["diversions_false"]),
        ("location RMSE, m", figures["geolocation_rmse_m"]),
        ("located within two sigmas", figures["geolocation_within_2_sigma"]),
    ]
    return Table(("", ""), rows)


def _parcels(parcels: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        (one["vehicle"], one["time_s"], one["to_target_m"], one["to_place_m"], "yes" if one["safe"] else one["unsafe"])
        for one in parcels
    ]
    return Table(("parcel of", "at rest, s", "to the area, m", "to its place, m", "safe"), rows)


def _targets(targets: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        (number, one["label"], one["area_m2"], "yes" if one["found"] else "no", one["iou"])
        for number, one in enumerate(targets, 1)
    ]
    return Table(("", "label", "true area, m²", "found", "IoU"), rows)


def _diversions(diverted: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        (one["time_s"], one["vehicle"], one["label"], one["error_m"], one["sigma_m"], "yes" if one["false"] else "no")
        for one in diverted
    ]
    return Table(("diverted, s", "vehicle", "to", "error of the edge, m", "stated sigma, m", "false"), rows)
