"""The parts of a run's report.html that a mission adds: tables, plots, and marks on the map. Plain data, no HTML.

`sitl_emu/run/report.py` draws them beside what all runs have: map, heights, frames and events.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

OTHER_COLOUR = "#999999"


class Mark(NamedTuple):
    """A place on the map, in metres from the world's origin; marks with one label are one row of the legend."""

    north_m: float
    east_m: float
    label: str
    colour: str = "#d50000"
    marker: str = "x"
    """As matplotlib names them."""


class Line(NamedTuple):
    """A line on the map, its places (north, east) in metres; lines with one label are one row of the legend."""

    places_m: Sequence[tuple[float, float]]
    label: str
    colour: str = "#d50000"
    style: str = "--"
    """As matplotlib names them."""


class Table(NamedTuple):
    """A table; None stands for what is not known."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]


class Plot(NamedTuple):
    """A plot, drawn on the matplotlib axes that it is handed."""

    draw: Callable[[Any], None]
    height_in: float = 3.0


class Section(NamedTuple):
    """A heading and what stands below it."""

    title: str
    parts: Sequence[Table | Plot]


class Page(NamedTuple):
    """What a mission adds to a report."""

    sections: Sequence[Section] = ()
    marks: Sequence[Mark] = ()
    colours: Mapping[str, str] = {}
    """Of the kinds of things that stand in the world, on the map; a kind without one is grey."""
    lines: Sequence[Line] = ()
    seeks_things: bool = True
    """Whether things are what it looks for: then the map tells targets from distractors."""
