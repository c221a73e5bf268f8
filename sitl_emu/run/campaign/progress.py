"""How a campaign goes on, for people: a bar with an estimate on a terminal, a line for each run elsewhere."""

from collections.abc import Callable

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from sitl_emu.run.campaign.flight import Result
from sitl_emu.run.score import SUCCESS


class Estimate:
    """How long the rest takes: as long as runs of this campaign took, so many at a time."""

    def __init__(self, places: int) -> None:
        self._places, self._walls_s = places, list[float]()

    def add(self, wall_s: float) -> None:
        """A run is done, and took so long."""
        self._walls_s.append(wall_s)

    def left_s(self, left: int) -> float | None:
        """For so many more runs; None where none is done yet."""
        if not self._walls_s:
            return None
        return left * (sum(self._walls_s) / len(self._walls_s)) / min(self._places, max(left, 1))


def said_of(seconds: float | None) -> str:
    """A duration for people; empty where it is not known."""
    if seconds is None:
        return ""
    if seconds < 90.0:
        return f"about {seconds:.0f} s left"
    return f"about {seconds / 60.0:.0f} min left" if seconds < 5400.0 else f"about {seconds / 3600.0:.1f} h left"


class CampaignView:
    """The bar, or the lines."""

    def __init__(self, console: Console, planned: int, there: int, places: int) -> None:
        self._console, self._planned, self._done = console, planned, there
        self._estimate = Estimate(places)
        self._bar: Progress | None = None
        if console.is_terminal:
            columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
            self._bar = Progress(*columns, console=console)
            self._task = self._bar.add_task("", total=planned, completed=there)
            self._bar.start()

    def ended(self, result: Result) -> None:
        """A run is done, or was not to be."""
        self._done += result.summary is not None
        self._estimate.add(result.wall_s)
        left = said_of(self._estimate.left_s(self._planned - self._done)) if self._done < self._planned else ""
        line = f"{self._done}/{self._planned}  {result.arm}, seed {result.seed}: {_said(result)}, {result.wall_s:.0f} s"
        if self._bar is None:
            self.say(f"{line}; {left}" if left else line)
        else:
            self._bar.update(self._task, completed=self._done, description=left)
            if result.summary is None or result.summary["outcome"] != SUCCESS:
                self.say(line)

    def say(self, line: str) -> None:
        """A line."""
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)

    @property
    def close(self) -> Callable[[], None]:
        """Call it at the end."""
        return self._bar.stop if self._bar is not None else lambda: None


def _said(result: Result) -> str:
    if result.summary is not None:
        return str(result.summary["outcome"])
    return "stopped" if result.stopped else f"not flown: {result.refused or result.accident}"
