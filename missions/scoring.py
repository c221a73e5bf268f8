"""What a mission's score is made from, and what it says: the contract between a run and its missions.

A run hands over what happened (`RunRecord`); the mission's own `score` module compares it with the truth and answers
with a `MissionScore`, from which the run derives its one outcome (`sitl_emu/run/score.py`).
"""

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

EventLine = Mapping[str, Any]
"""A line of events.jsonl: time_s, vehicle, event, and the data of its kind (`missions/companion/companion.py`)."""


class TrueObject(NamedTuple):
    """A thing that truly stands in the world; metres north and east of the world's origin."""

    kind: str
    north_m: float
    east_m: float
    radius_m: float
    target: bool
    """Whether it is to be found; what is not to be found is there to be mistaken for it."""


class TrueArea(NamedTuple):
    """What covers the ground at the run's beginning: a body of water, a fire, or plants."""

    kind: str
    """water, fire, grass, crop or canopy; solid: what stands."""
    name: str
    label: str
    outline_m: Sequence[tuple[float, float]]
    """Corners (north, east)."""
    islands_m: Sequence[Sequence[tuple[float, float]]] = ()
    """Outlines of what is dry within water."""
    front_m_s: tuple[float, float] = (0.0, 0.0)
    """Of a fire: how fast its front moves, north and east; what it has reached is the outline, swept along that way."""
    burns_s: float = 0.0
    """Of a fire: for how long a place burns; 0: without end."""
    level_m: float | None = None
    """Of water: how high its surface is over the world's origin."""


class Track(NamedTuple):
    """A vehicle's true path: columns over time, at least one row."""

    time_s: list[float]
    north_m: list[float]
    east_m: list[float]
    up_m: list[float]

    def at(self, time_s: float) -> tuple[float, float]:
        """(north_m, east_m) at a time."""
        i = min(max(bisect_left(self.time_s, time_s), 0), len(self.time_s) - 1)
        return self.north_m[i], self.east_m[i]


class RunRecord(NamedTuple):
    """What happened in a run, and what was true."""

    events: Sequence[EventLine]
    objects: Sequence[TrueObject]
    tracks: Mapping[str, Track]
    """True paths by vehicle; a vehicle without a row has none."""
    to_metres: Callable[[float, float], tuple[float, float]]
    """(latitude, longitude) in degrees to metres (north, east) of the world's origin."""
    areas: Sequence[TrueArea] = ()
    ground_m: Callable[[float, float], float] | None = None
    """The true ground's height at (north, east), over the world's origin; None where no world is known."""
    folder: Path | None = None
    """The run's, in which a score finds files that its companions have written."""
    origin_amsl_m: float = 0.0
    """Of the world."""


class MissionScore(NamedTuple):
    """What a mission reached, by the truth."""

    figures: dict[str, Any]
    """What summary.json says of it: JSON values."""
    lines: list[str]
    """The same for people."""
    shortfalls: list[str]
    """What keeps the mission from being a success, a few words each; empty where nothing does."""


def together(scores: Sequence[MissionScore]) -> MissionScore | None:
    """The one score of a run that several missions have scored; None where none has."""
    if not scores:
        return None
    return MissionScore(
        {key: value for one in scores for key, value in one.figures.items()},
        [line for one in scores for line in one.lines],
        [shortfall for one in scores for shortfall in one.shortfalls],
    )
