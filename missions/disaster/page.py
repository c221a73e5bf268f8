"""What the disaster mission adds to a run's report: targets and parcels as tables, and on the map what was flown."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from sitl_emu.missions.mission import Figures
from sitl_emu.missions.reporting import Line, Mark, Page, Plot, Section, Table

COLOURS = {"water_body": "#1565c0", "debris_field": "#6d4c41", "fire_region": "#d84315"}
"""Of areas on the map."""
THINGS = {"person": "#ad1457", "car": "#5e35b1", "truck": "#4527a0"}
AREA_COLOUR, LINE_COLOUR, PARCEL_COLOUR, PLACE_COLOUR = "#263238", "#90a4ae", "#00c853", "#d50000"
SIGHTING_COLOUR = "#ff6d00"


def page(figures: Figures) -> Page:
    """From the figures of its score (`score.py`)."""
    marks = [
        Mark(one["north_m"], one["east_m"], f"located {one['located']}", PLACE_COLOUR) for one in figures["diverted"]
    ]
    marks += [
        Mark(one["north_m"], one["east_m"], "middle by one frame", SIGHTING_COLOUR, "+") for one in figures["sightings"]
    ]
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
    if figures["terrain"] is not None:
        sections.append(Section("Terrain map", [_terrain(figures["terrain"]), *_grids(figures["terrain"])]))
    return Page(sections, marks, THINGS, lines, seeks_things=False)


def _terrain(terrain: Mapping[str, Any]) -> Table:
    rows = [
        (
            "RMS error of heights over home where nothing stands, against the true ground or water, m",
            terrain["rms_m"],
        ),
        ("mean error, m", terrain["bias_m"]),
        ("worst, m", terrain["worst_m"]),
        ("home's own height above the sea is off by, m", terrain["home_off_m"]),
        ("share of the area that is mapped", terrain["known_share"]),
    ]
    return Table(("", ""), rows)


def _grids(terrain: Mapping[str, Any]) -> list[Plot]:
    errors = [abs(value) for row in terrain["errors_m"] for value in row if value is not None]
    most = max([0.1, *errors])
    return [
        _grid(terrain, "heights_m", "mapped height above the origin, m", cmap="viridis"),
        _grid(terrain, "errors_m", "mapped less true height, m", cmap="RdBu_r", vmin=-most, vmax=most),
    ]


def _grid(terrain: Mapping[str, Any], key: str, label: str, **look: Any) -> Plot:
    def draw(axes: Any) -> None:
        rows = [[math.nan if value is None else value for value in row] for row in terrain[key]]
        image = axes.imshow(rows, origin="lower", extent=terrain["extent_m"], interpolation="nearest", **look)
        axes.figure.colorbar(image, ax=axes, label=label)
        axes.set_aspect("equal")
        axes.set_facecolor("#cfcfcf")
        axes.set_xlabel("east, m")
        axes.set_ylabel("north, m")

    return Plot(draw, 5.0)


def _delivery(figures: Figures) -> Table:
    rows: list[tuple[object, ...]] = [
        ("ending", figures["ending"]),
        ("reason of the abort", figures["abort_reason"]),
        ("all aborts", ", ".join(figures["aborts"]) or None),
        ("diversions", figures["diversions"]),
        ("of these false", figures["diversions_false"]),
        ("location RMSE, m", figures["geolocation_rmse_m"]),
        ("location by one frame each, RMSE, m", figures["sighting_rmse_m"]),
        ("located within two sigmas", figures["geolocation_within_2_sigma"]),
        ("lines flown after, s", figures["coverage_s"]),
    ]
    if figures["separation_m"] is not None:
        rows += [
            ("parcels for a target that had one", figures["served_twice"]),
            ("least distance between two vehicles, m", figures["separation_m"]),
        ]
    return Table(("", ""), rows)


def _parcels(parcels: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        (one["vehicle"], one["time_s"], one["to_target_m"], one["to_place_m"],
         "not seen" if one["to_seen_m"] is None else one["to_seen_m"], "yes" if one["safe"] else one["unsafe"])
        for one in parcels
    ]  # fmt: skip
    head = ("parcel of", "at rest, s", "to the area, m", "to its place, m", "to where the camera saw it, m", "safe")
    return Table(head, rows)


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
    return Table(("diverted, s", "vehicle", "to", "error of what is located, m", "stated sigma, m", "false"), rows)
