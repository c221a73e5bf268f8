"""What a mission is: the contract between a run and whoever brings a mission.

A mission is one package, found by an entry point of the group `sitl_emu.missions` (`registry.py`). The entry point's
name is the mission's, its value a `Mission`:

    [project.entry-points."sitl_emu.missions"]
    up_and_down = "up_and_down.mission:MISSION"

A `Mission` lists what the package brings. Of this only `programs` is needed: state machines for companion computers,
each with a name of its own that scenario files and `sitl_emu.missions.companion.main --mission` use. The module that
holds the `Mission` is imported whenever missions are listed, so it should import what is heavy (OpenCV, numpy) in its
functions.

What scenarios say of it: `reporting.py` has the parts of a report's page, `scoring.py` what a score is made from.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu.missions.companion.companion import Companion
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.reporting import Page
from sitl_emu.missions.scoring import MissionScore, RunRecord

Figures = Mapping[str, Any]
"""What summary.json holds."""


class Setting(NamedTuple):
    """Where, and aboard what, a program is to run in a simulated run: what its plan follows, and its checks look at."""

    vehicle: str
    """Name of the vehicle in the scenario."""
    calibration: Path | None
    """The calibration file of its camera (`companion/calibration.py`); None where it has no camera."""
    world: str
    """Kind of the world."""
    home: tuple[float, float, float]
    """The world's origin: latitude and longitude in degrees, altitude in metres AMSL."""
    outline_m: Sequence[tuple[float, float]]
    """Corners (north, east) of what the world is about, from its origin; empty for a world without an outline."""
    folder: Path
    """Where files for the run may be written; their names should begin with the vehicle's."""
    seed: int = 1
    """The run's."""
    systems: Sequence[int] = ()
    """MAVLink systems of the vehicles that run this program with the same options, this one among them."""


def as_given(options: dict[str, Any], _setting: Setting) -> dict[str, Any]:
    """The options unchanged: for a program that needs no plan of the place and has nothing to check there."""
    return options


class Program(NamedTuple):
    """The program of one companion computer."""

    make: Callable[[Options], Companion]
    """Makes it from its options. It takes each by name, type and range from `Options`, which says what is wrong with
    one in a line for people; other ValueErrors are told to people too. Options that it did not take are errors."""
    prepare: Callable[[dict[str, Any], Setting], dict[str, Any]] = as_given
    """For a simulated run, before anything starts: checks what the program needs (ValueError says what is missing), and
    returns the options as they are to be run with, a plan that follows the world among them. Called twice: to check,
    with a folder that is thrown away, and to run."""


class Mission(NamedTuple):
    """A mission, as its package brings it."""

    programs: Mapping[str, Program]
    """Programs of companion computers by name: the mission's own, or that with a role after a hyphen."""
    scenarios: Path | None = None
    """Folder of scenario files, NAME.yaml, which `sitl-emu run NAME` finds."""
    score: Callable[[RunRecord], MissionScore] | None = None
    """Compares what the companions reported with the truth; without it a run is judged by its companions' outcomes."""
    page: Callable[[Figures], Page] | None = None
    """What the mission adds to report.html, from the figures of summary.json, which hold those of its score."""
    evaluation: "Callable[[Sequence[Figures]], Sequence[Row]] | None" = None
    """Rows of the table that `make evaluate` prints, from the summaries of several seeds."""


class Row(NamedTuple):
    """One row of an evaluation's table."""

    what: str
    reached: str
    wanted: str
    good: bool
