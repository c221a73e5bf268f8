"""report.html of a run: one file with everything in it, for people.

Map of the field with tracks, true and reported targets; heights over time; errors; the frames that confirmed a target.
"""

import base64
import html
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from missions.scoring import Track
from sitl_emu.run import score

matplotlib.use("Agg")

KIND_COLOURS = {
    "weed": "#2e7d32",
    "disease": "#c77800",
    "bare_soil": "#b08968",
    "puddle": "#6fa8c9",
    "residue": "#d8c690",
    "shade": "#8a8f98",
    "pale_corn": "#c5d86d",
    "lush_corn": "#7cb342",
}
TRACK_COLOURS = ("#1565c0", "#6a1b9a", "#00838f", "#ad1457", "#4e342e")

PHOTO_ALPHA = 0.55
"""The ground is paled, so that tracks and marks are seen before it."""

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: 1rem 0; } td, th { padding: .25rem .8rem; text-align: left; }
tr { border-bottom: 1px solid #ddd; } th { background: #f3f3f3; } img { max-width: 100%; }
figure { display: inline-block; margin: 0 1rem 1rem 0; } figcaption { color: #666; font-size: 13px; }
.success { color: #1b5e20; } .failure { color: #b71c1c; }
"""


def write(folder: Path, summary: dict[str, Any], truth: dict[str, Any], photo: np.ndarray | None = None) -> None:
    """Write report.html from what lies in the run's folder. `photo`: the outline from above, north up, uint8 RGB."""
    events = score.read_events(folder)
    names = sorted(path.stem.removeprefix("truth-") for path in folder.glob("truth-*.csv"))
    tracks = {name: score.read_track(folder, name) for name in names}
    verdict = "failure" if score.exit_status(summary) else "success"
    parts = [
        f"<h1>{html.escape(summary['scenario'])}, seed {summary['seed']}</h1>",
        f"<p class={verdict}><b>Outcome: {html.escape(summary['outcome'])}</b></p>",
        "".join(f"<p>{html.escape(line)}</p>" for line in score.lines(summary)),
    ]
    if any(track.time_s for track in tracks.values()):
        parts += [
            "<h2>Map</h2>",
            _image(draw_map(summary, truth, tracks, photo)),
            "<h2>Heights</h2>",
            _image(_heights(tracks)),
        ]
    if summary.get("targets"):
        parts += ["<h2>Targets</h2>", _targets(summary["targets"]), _image(_errors(summary["targets"]))]
    parts += ["<h2>Frames</h2>", _frames(folder, events), "<h2>Events</h2>", _events(events)]
    page = f"<!doctype html><html lang=en><meta charset=utf-8><title>{html.escape(summary['scenario'])}</title>"
    (folder / "report.html").write_text(f"{page}<style>{STYLE}</style><body>{''.join(parts)}</body></html>\n")


def draw_map(
    summary: dict[str, Any], truth: dict[str, Any], tracks: dict[str, Track], photo: np.ndarray | None
) -> Figure:
    """Field, true tracks, what is really there, and what was reported."""
    figure = Figure(figsize=(9, 8), layout="constrained")
    axes = figure.add_subplot()
    outline = truth.get("outline", [])
    if outline:
        north, east = zip(*[*outline, outline[0]], strict=True)
        axes.fill(east, north, color="#f4f1e4", zorder=0)
        if photo is not None:
            axes.imshow(photo, extent=(min(east), max(east), min(north), max(north)), alpha=PHOTO_ALPHA, zorder=0)
        axes.plot(east, north, color="#8d8468", linewidth=1, zorder=1)
    drawn = set[str]()
    for thing in truth.get("objects", []):
        colour, kind = KIND_COLOURS.get(thing["kind"], "#999"), thing["kind"]
        edge = "black" if thing["target"] else "none"
        label = f"{'target' if thing['target'] else 'distractor'}: {kind}" if kind not in drawn else None
        drawn.add(kind)
        axes.scatter(
            thing["east_m"],
            thing["north_m"],
            s=110 if thing["target"] else 40,
            marker="o" if thing["target"] else "s",
            color=colour,
            edgecolors=edge,
            label=label,
            zorder=3,
        )
    for (name, track), colour in zip(tracks.items(), TRACK_COLOURS * len(tracks), strict=False):
        axes.plot(track.east_m, track.north_m, color=colour, linewidth=1.3, label=f"{name}, true track", zorder=2)
    for number, one in enumerate(summary.get("reported", [])):
        axes.scatter(
            one["east_m"],
            one["north_m"],
            marker="x",
            s=90,
            color="#d50000",
            label="reported" if number == 0 else None,
            zorder=5,
        )
    axes.set_aspect("equal")
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9, frameon=False)
    return figure


def _heights(tracks: dict[str, Track]) -> Figure:
    figure = Figure(figsize=(9, 3), layout="constrained")
    axes = figure.add_subplot()
    for (name, track), colour in zip(tracks.items(), TRACK_COLOURS * len(tracks), strict=False):
        axes.plot(track.time_s, track.up_m, color=colour, label=name)
    axes.set_xlabel("simulated time, s")
    axes.set_ylabel("height above the origin, m")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure


def _errors(targets: list[dict[str, Any]]) -> Figure:
    figure = Figure(figsize=(9, 3), layout="constrained")
    axes = figure.add_subplot()
    kinds = (
        ("geolocation_error_m", "geolocation", "#1565c0"),
        ("ugv_stop_error_m", "UGV from its waypoint", "#6a1b9a"),
        ("ugv_target_error_m", "UGV from the true target", "#ad1457"),
    )
    for place, (key, label, colour) in enumerate(kinds):
        at = [number + 0.25 * (place - 1) for number in range(len(targets))]
        axes.bar(at, [target[key] or 0.0 for target in targets], width=0.22, label=label, color=colour)
    axes.set_xticks(range(len(targets)), [f"{number + 1} {target['kind']}" for number, target in enumerate(targets)])
    axes.set_ylabel("error, m")
    axes.grid(alpha=0.3, axis="y")
    axes.legend(frameon=False, fontsize=9)
    return figure


def _targets(targets: list[dict[str, Any]]) -> str:
    columns: dict[str, Callable[[dict[str, Any]], object]] = {
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
    rows = []
    for number, target in enumerate(targets, 1):
        cells = (number, *(cell(target) for cell in columns.values()))
        rows.append("".join(f"<td>{'–' if cell is None else html.escape(str(cell))}</td>" for cell in cells))
    return _table("".join(f"<th>{head}</th>" for head in ("", *columns)), rows)


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
    return "".join(figures) or "<p>No target was confirmed in a frame.</p>"


def _image(figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    return f"<img src='data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}' alt=''>"
