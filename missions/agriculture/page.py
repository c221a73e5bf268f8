"""What the agriculture mission adds to a run's report: the truth's table, its errors, and what was reported where."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sitl_emu.missions.mission import Figures
from sitl_emu.missions.reporting import Line, Mark, Page, Plot, Section, Table

COLOURS = {
    "weed": "#2e7d32",
    "disease": "#c77800",
    "bare_soil": "#b08968",
    "puddle": "#6fa8c9",
    "residue": "#d8c690",
    "shade": "#8a8f98",
    "pale_corn": "#c5d86d",
    "lush_corn": "#7cb342",
}
"""Of targets and distractors on the map."""
WAY_COLOUR = "#263238"
ERRORS = (
    ("geolocation_error_m", "geolocation", "#1565c0"),
    ("ugv_stop_error_m", "UGV from its waypoint", "#6a1b9a"),
    ("ugv_target_error_m", "UGV from the true target", "#ad1457"),
)
COLUMNS: Mapping[str, Callable[[Mapping[str, Any]], object]] = {
    "kind": lambda target: target["kind"],
    "radius, m": lambda target: target["radius_m"],
    "confirmed": lambda target: "yes" if target["confirmed"] else "no",
    "seen as": lambda target: target["label"],
    "score": lambda target: target["score"],
    "inspection by the UGV": lambda target: (target["inspection"] or "none").replace("_", " "),
    "geolocation error, m": lambda target: target["geolocation_error_m"],
    "UGV to waypoint, m": lambda target: target["ugv_stop_error_m"],
    "to target, m": lambda target: target["ugv_target_error_m"],
}


def page(figures: Figures) -> Page:
    """From the figures of its score (`score.py`)."""
    targets = figures["targets"]
    marks = [Mark(one["north_m"], one["east_m"], "reported") for one in figures["reported"]]
    lines = [Line(way["places_m"], f"{way['vehicle']}, planned way", WAY_COLOUR) for way in figures["ugv_ways"]]
    return Page([Section("Targets", [_table(targets), _errors(targets)])] if targets else [], marks, COLOURS, lines)


def _table(targets: Sequence[Mapping[str, Any]]) -> Table:
    rows = [(number, *(cell(target) for cell in COLUMNS.values())) for number, target in enumerate(targets, 1)]
    return Table(("", *COLUMNS), rows)


def _errors(targets: Sequence[Mapping[str, Any]]) -> Plot:
    def draw(axes: Any) -> None:
        for place, (key, label, colour) in enumerate(ERRORS):
            at = [number + 0.25 * (place - 1) for number in range(len(targets))]
            axes.bar(at, [target[key] or 0.0 for target in targets], width=0.22, label=label, color=colour)
        names = [f"{number} {target['kind']}" for number, target in enumerate(targets, 1)]
        axes.set_xticks(range(len(targets)), names)
        axes.set_ylabel("error, m")
        axes.grid(alpha=0.3, axis="y")
        axes.legend(frameon=False, fontsize=9)

    return Plot(draw)
