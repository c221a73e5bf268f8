"""report.html of a run: one file with everything in it, for people.

A map with the tracks, what truly stands there and what the missions mark; heights over time; what the missions add
(`missions/reporting.py`); the frames that events name; all events.
"""

import base64
import csv
import html
import io
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Path2D

from sitl_emu.missions.reporting import OTHER_COLOUR, Page, Plot, Section, Table
from sitl_emu.missions.scoring import Track
from sitl_emu.run import score
from sitl_emu.run.recorder import LOOSE

matplotlib.use("Agg")

Way = list[tuple[float, float]]
"""(north, east) in m, one after the other."""
TRACK_COLOURS = ("#1565c0", "#6a1b9a", "#00838f", "#ad1457", "#4e342e")

AREA_COLOURS = {
    "water": "#1e88e5", "fire": "#ff6d00", "grass": "#9ccc65", "crop": "#c0a030", "canopy": "#2e7d32",
}  # fmt: skip
PHOTO_ALPHA = 0.55
"""The ground is paled, so that tracks and marks are seen before it."""

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: 1rem 0; } td, th { padding: .25rem .8rem; text-align: left; }
tr { border-bottom: 1px solid #ddd; } th { background: #f3f3f3; } img { max-width: 100%; }
figure { display: inline-block; margin: 0 1rem 1rem 0; } figcaption { color: #666; font-size: 13px; }
.success { color: #1b5e20; } .failure { color: #b71c1c; }
"""


def write(
    folder: Path,
    summary: dict[str, Any],
    truth: Mapping[str, Any],
    pages: Sequence[Page] = (),
    photo: np.ndarray | None = None,
    ground_m: Callable[[float, float], float] | None = None,
) -> None:
    """Write report.html from what lies in the run's folder.

    `pages`: what the missions add. `photo`: the outline from above, north up, uint8 RGB. `ground_m`: the ground's
    height at metres north and east, which is drawn under each vehicle.
    """
    events = score.read_events(folder)
    names = sorted(path.stem.removeprefix("truth-") for path in folder.glob("truth-*.csv"))
    tracks = {name: score.read_track(folder, name) for name in names}
    verdict = "failure" if score.exit_status(summary) else "success"
    parts = [
        f"<h1>{html.escape(summary['scenario'])}, seed {summary['seed']}</h1>",
        f"<p class={verdict}><b>Outcome: {html.escape(summary['outcome'])}</b></p>",
        "".join(f"<p>{html.escape(line)}</p>" for line in score.lines(summary) + score.details(summary)),
    ]
    if any(track.time_s for track in tracks.values()):
        parts += [
            "<h2>Map</h2>",
            _image(draw_map(truth, tracks, pages, photo, read_ways(folder))),
            "<h2>Heights</h2>",
            _image(_heights(tracks, ground_m)),
        ]
    parts += [section_html(section) for page in pages for section in page.sections]
    parts += ["<h2>Frames</h2>", _frames(folder, events), "<h2>Events</h2>", _events(events)]
    page = f"<!doctype html><html lang=en><meta charset=utf-8><title>{html.escape(summary['scenario'])}</title>"
    text = f"{page}<style>{STYLE}</style><body>{''.join(parts)}</body></html>\n"
    (folder / "report.html").write_text(text, "utf-8")


def draw_map(
    truth: Mapping[str, Any],
    tracks: dict[str, Track],
    pages: Sequence[Page],
    photo: np.ndarray | None,
    ways: Mapping[str, Way] | None = None,
) -> Figure:
    """Outline, true tracks, what is really there, and what the missions mark; `ways`: of loose bodies."""
    figure = Figure(figsize=(9, 8), layout="compressed")
    axes = figure.add_subplot()
    outline = truth.get("outline", [])
    if outline:
        north, east = zip(*[*outline, outline[0]], strict=True)
        axes.fill(east, north, color="#f4f1e4", zorder=0)
        if photo is not None:
            axes.imshow(photo, extent=(min(east), max(east), min(north), max(north)), alpha=PHOTO_ALPHA, zorder=0)
        axes.plot(east, north, color="#8d8468", linewidth=1, zorder=1)
    drawn = set[str]()
    _draw_areas(axes, truth.get("areas", []))
    _draw_loose(axes, truth.get("loose", []), ways or {})
    sought = any(page.seeks_things for page in pages) or not pages
    for thing in truth.get("objects", []):
        kind, is_target = thing["kind"], thing["target"] and sought
        colour = next((page.colours[kind] for page in pages if kind in page.colours), OTHER_COLOUR)
        edge = "black" if is_target else "none"
        name = f"{'target' if is_target else 'distractor'}: {kind}" if sought else kind.replace("_", " ")
        label = name if kind not in drawn else None
        drawn.add(kind)
        axes.scatter(
            thing["east_m"],
            thing["north_m"],
            s=110 if is_target else 40,
            marker="o" if is_target else "s",
            color=colour,
            edgecolors=edge,
            label=label,
            zorder=3,
        )
    for (name, track), colour in zip(tracks.items(), TRACK_COLOURS * len(tracks), strict=False):
        axes.plot(track.east_m, track.north_m, color=colour, linewidth=1.3, label=f"{name}, true track", zorder=2)
    for line in (line for page in pages for line in page.lines):
        label = line.label if line.label not in drawn else None
        drawn.add(line.label)
        north, east = zip(*line.places_m, strict=True)
        axes.plot(east, north, color=line.colour, linestyle=line.style, linewidth=1.0, label=label, zorder=2.5)
    for mark in (mark for page in pages for mark in page.marks):
        label = mark.label if mark.label not in drawn else None
        drawn.add(mark.label)
        axes.scatter(mark.east_m, mark.north_m, marker=mark.marker, s=90, color=mark.colour, label=label, zorder=5)
    axes.set_aspect("equal")
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
    figure.legend(loc="outside right center", fontsize=9, frameon=False)  # beside the map, however wide that is
    figure.draw_without_rendering()  # the first time the legend's width is not known yet, and labels end outside
    return figure


def read_ways(folder: Path) -> dict[str, Way]:
    """Where a run's loose bodies were, by name."""
    ways: dict[str, Way] = {}
    if (folder / LOOSE).exists():
        with (folder / LOOSE).open(newline="") as file:
            for row in csv.DictReader(file):
                ways.setdefault(row["name"], []).append((float(row["north_m"]), float(row["east_m"])))
    return ways


def _draw_loose(axes: Any, loose: Sequence[dict[str, Any]], ways: Mapping[str, Way]) -> None:
    """Where loose bodies came to lie, the way there, and those that were released in the run as well."""
    drawn = set[str]()
    labels = {body["name"]: body["label"] for body in loose}
    first = {body["name"]: [(body["place_m"][0], body["place_m"][1])] for body in loose}
    for name, way in {**first, **ways}.items():
        label = labels.get(name, name)
        north, east = zip(*way, strict=True)
        axes.plot(east, north, color=OTHER_COLOUR, linewidth=1, linestyle=":", zorder=2)
        shown = label if label not in drawn else None
        drawn.add(label)
        axes.scatter(
            east[-1], north[-1], s=40, marker="D", color=OTHER_COLOUR, edgecolors="black", label=shown, zorder=3
        )


def _draw_areas(axes: Any, areas: Sequence[dict[str, Any]]) -> None:
    """Water, fires and plants as they were at the beginning; a fire's front with an arrow."""
    drawn = set[str]()
    for area in areas:
        north, east = zip(*area["outline_m"], strict=True)
        label = area["label"] if area["label"] not in drawn else None
        drawn.add(area["label"])
        rings = [area["outline_m"], *area.get("islands_m", [])]
        whole = Path2D.make_compound_path(
            *[Path2D([(e, n) for n, e in (*ring, ring[0])], closed=True) for ring in rings]
        )
        colour = AREA_COLOURS[area["kind"]]
        axes.add_patch(PathPatch(whole, color=colour, alpha=0.5, linewidth=0, label=label, zorder=0.5))
        axes.update_datalim([(e, n) for n, e in area["outline_m"]])
        front_n, front_e = area.get("front_m_s", (0.0, 0.0))
        if front_n or front_e:
            middle = sum(east) / len(east), sum(north) / len(north)
            length = 10.0 / math.hypot(front_n, front_e)
            tip = middle[0] + length * front_e, middle[1] + length * front_n
            axes.annotate("", tip, middle, arrowprops={"arrowstyle": "->", "color": colour}, zorder=1)


def _heights(tracks: dict[str, Track], ground_m: Callable[[float, float], float] | None) -> Figure:
    figure = Figure(figsize=(9, 3), layout="constrained")
    axes = figure.add_subplot()
    for (name, track), colour in zip(tracks.items(), TRACK_COLOURS * len(tracks), strict=False):
        axes.plot(track.time_s, track.up_m, color=colour, label=name)
        if ground_m is not None:
            under_m = [ground_m(*place) for place in zip(track.north_m, track.east_m, strict=True)]
            axes.plot(track.time_s, under_m, color=colour, linewidth=0.8, label=f"ground under {name}")
    axes.set_xlabel("simulated time, s")
    axes.set_ylabel("height above the origin, m")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure


def section_html(section: Section) -> str:
    """A heading with its tables and plots."""
    parts = [_rows(part) if isinstance(part, Table) else _plot(part) for part in section.parts]
    return f"<h2>{html.escape(section.title)}</h2>{''.join(parts)}"


def _rows(table: Table) -> str:
    """A mission's table; what is not known is a dash."""
    rows = [
        "".join(f"<td>{'–' if cell is None else html.escape(str(cell))}</td>" for cell in cells) for cells in table.rows
    ]
    return _table("".join(f"<th>{html.escape(head)}</th>" for head in table.head), rows)


def _plot(plot: Plot) -> str:
    """A mission's plot."""
    figure = Figure(figsize=(9, plot.height_in), layout="compressed")  # as maps keep their aspect
    plot.draw(figure.add_subplot())
    return _image(figure)


def _events(events: list[dict[str, Any]]) -> str:
    rows = [
        "".join(
            f"<td>{html.escape(str(cell))}</td>"
            for cell in (f"{event['time_s']:.1f} s", event["vehicle"], event["event"], event.get("text", ""))
        )
        for event in events
    ]
    return _table("<th>time</th><th>vehicle</th><th>event</th><th></th>", rows)


def _table(head: str, rows: list[str]) -> str:
    return f"<table><tr>{head}</tr>{''.join(f'<tr>{row}</tr>' for row in rows)}</table>"


def _frames(folder: Path, events: list[dict[str, Any]]) -> str:
    figures = []
    for event in events:
        picture = folder / event["picture"] if "picture" in event else None
        if picture is not None and picture.is_file():
            data = base64.b64encode(picture.read_bytes()).decode()
            text = html.escape(f"{event['time_s']:.1f} s, {event['vehicle']}: {event.get('text', '')}")
            source = f"data:image/jpeg;base64,{data}"
            figures.append(f"<figure><img width=480 src='{source}' alt=''><figcaption>{text}</figcaption></figure>")
    return "".join(figures) or "<p>No event tells of a frame.</p>"


def _image(figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    return f"<img src='data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}' alt=''>"
