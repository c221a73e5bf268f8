"""report.html of a campaign: what its arms reached, beside one another; tables, intervals, plots, and all its runs."""

import html
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu.missions.mission import Mission, Row
from sitl_emu.missions.reporting import Plot, Section, Table
from sitl_emu.run.campaign import statistics, tables
from sitl_emu.run.campaign.arms import Arm
from sitl_emu.run.campaign.flight import Result
from sitl_emu.run.campaign.statistics import Interval, Mean, Share
from sitl_emu.run.campaign.store import Store, write_whole
from sitl_emu.run.report import STYLE, section_html

Rows = Sequence[Mapping[str, Any]]
FEWEST_FOR_A_LINE = 3
"""Values of a key that make an axis of it."""
NARROW_IN, A_ROW_IN, A_LINE_IN = 1.2, 0.32, 0.16
"""A plot's height, what each arm adds to it, and what each further line of an arm's name does."""
NAME_WIDTH = 36
"""Characters of a line of an arm's name beside a plot: longer ones leave no room for the plot."""


class Outcome(NamedTuple):
    """A campaign as far as it went."""

    name: str
    arms: Mapping[str, Arm]
    results: Sequence[Result]
    """Those of the runs that are there."""
    planned: int
    missing: Sequence[str]
    """What became of the others, a line each."""
    missions: Sequence[Mission]


def sections_of(outcome: Outcome) -> list[Section]:
    """What a report holds, as plain data; also what is printed."""
    rows = tables.rows_of(outcome.results, outcome.arms)
    by_arm = {name: [row for row in rows if row["arm"] == name] for name in outcome.arms}
    varied = dict.fromkeys(key for arm in outcome.arms.values() for key in arm.values)
    columns = tables.varied_columns(outcome.results, outcome.arms)
    leave = (*tables.HEAD, *columns.values(), *tables.MACHINE)
    figures = statistics.figures_of(rows, leave)
    made = [_success(by_arm, outcome.arms, list(varied)), *_wanted(outcome)]
    made += [_figures(by_arm, figures)] if figures else []
    if len(by_arm) > 1 and rows:
        made.append(_beside_the_first(by_arm, ["success", *figures]))
    return made


def write(store: Store, outcome: Outcome, sections: Sequence[Section]) -> Path:
    """Write the report; its file. Raises Trouble."""
    there = f"{len(outcome.results)} of {outcome.planned} runs"
    arms = "".join(
        f"<li><a href='arms/{html.escape(arm.slug)}.yaml'>{html.escape(name)}</a></li>"
        for name, arm in outcome.arms.items()
    )
    parts = [
        f"<h1>Campaign {html.escape(outcome.name)}</h1><p>{there}. Arms fly the same seeds. Intervals are 95 %: "
        "Wilson's for shares, bootstrapped (BCa) for means. Tables: <a href='runs.csv'>runs.csv</a>, "
        f"<a href='runs.parquet'>runs.parquet</a>, and beside them.</p><ul>{arms}</ul>",
        "".join(f"<p class=failure>{html.escape(line)}</p>" for line in outcome.missing),
        *(section_html(section) for section in sections),
        _runs(store, outcome.results),
    ]
    page = f"<!doctype html><html lang=en><meta charset=utf-8><title>Campaign {html.escape(outcome.name)}</title>"
    path = store.folder / "report.html"
    write_whole(path, f"{page}<style>{STYLE}</style><body>{''.join(parts)}</body></html>\n")
    return path


def _success(by_arm: Mapping[str, Rows], arms: Mapping[str, Arm], varied: Sequence[str]) -> Section:
    """How many runs of each arm succeeded."""
    shares = {name: statistics.share(sum(row["success"] for row in rows), len(rows)) for name, rows in by_arm.items()}
    table = Table(
        ("arm", "missions that succeed", "share", "95 %"),
        [
            (name, f"{s.having} of {s.of}", _percent(s.having / s.of) if s.of else None, _shares(s))
            for name, s in shares.items()
        ],
    )
    estimates = {name: (s.having / s.of, s.interval) for name, s in shares.items() if s.of}
    plots = [_plot_of(estimates, {}, "share of missions that succeed", (0.0, 1.0))] if estimates else []
    plots += [
        _along(key, estimates, arms, "share that succeeds")
        for key in varied
        if len({arm.values[key] for arm in arms.values() if _is_number(arm.values[key])}) >= FEWEST_FOR_A_LINE
    ]
    return Section("Success", [table, *plots])


def _figures(by_arm: Mapping[str, Rows], figures: Sequence[str]) -> Section:
    """A table of every figure that differs from run to run, and a plot each."""
    lines, plots = list[tuple[object, ...]](), list[Plot]()
    for figure in figures:
        values = {name: list(statistics.values_of(rows, figure).values()) for name, rows in by_arm.items()}
        means = {name: statistics.mean_of(there) for name, there in values.items() if there}
        lines += [
            (
                figure,
                name,
                m.runs,
                _number(m.mean),
                _range(m.interval),
                _number(m.median),
                _number(m.least),
                _number(m.greatest),
            )
            for name, m in means.items()
        ]
        plots.append(_plot_of({name: (m.mean, m.interval) for name, m in means.items()}, values, figure, None))
    head = ("figure", "arm", "runs", "mean", "95 %", "median", "least", "greatest")
    return Section("Figures", [Table(head, lines), *plots])


def _beside_the_first(by_arm: Mapping[str, Rows], figures: Sequence[str]) -> Section:
    """What is other in each arm than in the first, seed by seed."""
    first, *others = by_arm
    lines = list[tuple[object, ...]]()
    for figure in figures:
        base = statistics.values_of(by_arm[first], figure)
        for name in others:
            mean = statistics.difference(base, statistics.values_of(by_arm[name], figure))
            if mean is not None:
                lines.append((figure, name, mean.runs, f"{mean.mean:+.3g}", _range(mean.interval), _says(mean)))
    head = ("figure", "arm", "pairs", "mean difference", "95 %", "")
    return Section(f"Beside “{first}”, seed by seed", [Table(head, lines)])


def _wanted(outcome: Outcome) -> list[Section]:
    """What the missions want of several runs, for each arm."""
    summaries = {
        name: [result.summary for result in outcome.results if result.arm == name and result.summary is not None]
        for name in outcome.arms
    }
    made = list[Section]()
    for mission in outcome.missions:
        if mission.evaluation is None:
            continue
        reached = {name: _rows(mission.evaluation, those) for name, those in summaries.items() if those}
        if not reached:
            continue
        whats = dict.fromkeys((row.what, row.wanted) for rows in reached.values() for row in rows)
        cells = {
            name: {row.what: f"{row.reached}{'' if row.good else ' ✗'}" for row in rows}
            for name, rows in reached.items()
        }
        lines = [(what, wanted, *(cells[name].get(what) for name in cells)) for what, wanted in whats]
        made.append(Section("What is wanted, and reached", [Table(("", "wanted", *cells), lines)]))
    return made


def _rows(evaluation: Callable[[Any], Sequence[Row]], summaries: Sequence[Mapping[str, Any]]) -> Sequence[Row]:
    """A mission's rows; one whose arithmetic fails says so."""
    try:
        return evaluation(summaries)
    except Exception as error:  # whatever a foreign package's arithmetic does
        return [Row("its evaluation failed", f"{type(error).__name__}: {error}", "", False)]


def _runs(store: Store, results: Sequence[Result]) -> str:
    """All runs, each with the way to its own report, if that was kept."""
    lines = list[str]()
    for result in results:
        page = store.run_folder(result.arm, result.seed) / "report.html"
        seed = f"seed {result.seed}"
        if page.is_file():
            seed = f"<a href='{html.escape(page.relative_to(store.folder.resolve()).as_posix())}'>{seed}</a>"
        outcome = html.escape(str((result.summary or {}).get("outcome")))
        lines.append(f"<tr><td>{html.escape(result.arm)}</td><td>{seed}</td><td>{outcome}</td></tr>")
    return f"<h2>Runs</h2><table><tr><th>arm</th><th>run</th><th>outcome</th></tr>{''.join(lines)}</table>"


Estimates = Mapping[str, tuple[float, Interval | None]]


def _plot_of(
    estimates: Estimates, values: Mapping[str, Sequence[float]], label: str, limits: tuple[float, float] | None
) -> Plot:
    """An arm a row: every run's value, the mean and its interval."""

    names = list(estimates)
    written = ["\n".join(textwrap.wrap(name, NAME_WIDTH, break_on_hyphens=False)) for name in names]
    most_lines = max((name.count("\n") for name in written), default=0)

    def draw(axes: Any) -> None:
        for place, name in enumerate(names):
            there = values.get(name, ())
            axes.scatter(there, [place] * len(there), s=14, color="#90a4ae", alpha=0.6, zorder=2)
            mean, interval = estimates[name]
            if interval is not None:
                axes.plot(interval, (place, place), color="#1565c0", linewidth=3, zorder=3)
            axes.scatter([mean], [place], s=46, color="#1565c0", zorder=4)
        axes.set_yticks(range(len(names)), written)
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlabel(label)
        axes.grid(axis="x", alpha=0.3)
        if limits is not None:
            axes.set_xlim(limits[0] - 0.02, limits[1] + 0.02)

    return Plot(draw, NARROW_IN + (A_ROW_IN + A_LINE_IN * most_lines) * len(names))


def _along(key: str, estimates: Estimates, arms: Mapping[str, Arm], label: str) -> Plot:
    """Estimates over the values of a key; arms that differ in it alone are joined."""
    lines = dict[str, list[tuple[float, str]]]()
    for name in estimates:
        values = arms[name].values
        if _is_number(values[key]):
            others = ", ".join(f"{other}={value}" for other, value in values.items() if other != key)
            lines.setdefault(others, []).append((float(values[key]), name))

    def draw(axes: Any) -> None:
        for others, places in lines.items():
            places.sort()
            x, y = [at for at, _ in places], [estimates[name][0] for _, name in places]
            spans = [estimates[name][1] or Interval(mean, mean) for (_, name), mean in zip(places, y, strict=True)]
            below = [mean - span.low for mean, span in zip(y, spans, strict=True)]
            above = [span.high - mean for mean, span in zip(y, spans, strict=True)]
            axes.errorbar(x, y, yerr=[below, above], marker="o", capsize=3, label=others or None)
        axes.set_xlabel(key)
        axes.set_ylabel(label)
        axes.set_ylim(-0.02, 1.02)
        axes.grid(alpha=0.3)
        if len(lines) > 1:
            axes.legend(frameon=False)

    return Plot(draw)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _shares(share: Share) -> str | None:
    return None if share.interval is None else f"{_percent(share.interval.low)} to {_percent(share.interval.high)}"


def _percent(value: float) -> str:
    return f"{100.0 * value:.0f} %"


def _range(interval: Interval | None) -> str | None:
    return None if interval is None else f"{_number(interval.low)} to {_number(interval.high)}"


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"


def _says(mean: Mean) -> str:
    """Whether an interval leaves nothing out."""
    if mean.interval is None:
        return "the same in every pair" if mean.runs > 1 and mean.least == mean.greatest == 0.0 else ""
    return "" if mean.interval.low <= 0.0 <= mean.interval.high else "differs"
