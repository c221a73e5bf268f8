"""What people see of a run: a live table on a terminal, plain lines elsewhere."""

from collections import deque
from collections.abc import Iterable
from typing import Any, Protocol

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from sitl_emu.run.messages import EventTold, Progress, VehicleProgress

RECENT_EVENTS = 8
PLAIN_PERIOD_S = 10.0
QUIET_EVENTS = {"phase"}


class View(Protocol):
    """Shows how a run goes."""

    def status(self, status: Progress) -> None:
        """Where time and vehicles are now."""
        ...

    def event(self, event: EventTold) -> None:
        """Something happened."""
        ...

    def close(self) -> None:
        """The run is over."""
        ...


def open_view(title: str, console: Console) -> View:
    """The live view on a terminal, else plain lines."""
    return LiveView(title, console) if console.is_terminal else PlainView(title, console)


def event_line(told: EventTold) -> str:
    """An event in words."""
    kind, text = told.event.kind, told.event.text
    return f"{told.time_s:7.1f} s  {told.vehicle:<8} {kind}{': ' + text if text else ''}"


class Speed:
    """The speed factor over the last moments."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, float]] = deque(maxlen=12)

    def of(self, status: Progress) -> float:
        """Simulated over wall time since some samples ago."""
        self._samples.append((status.time_s, status.wall_s))
        (time_0, wall_0), (time_1, wall_1) = self._samples[0], self._samples[-1]
        return (time_1 - time_0) / (wall_1 - wall_0) if wall_1 > wall_0 else 0.0


class PlainView:
    """Lines for logs: every event, and now and then how far the vehicles are."""

    def __init__(self, title: str, console: Console) -> None:
        self._console, self._speed, self._last_s = console, Speed(), 0.0
        self._print(title)

    def status(self, status: Progress) -> None:
        """A line each PLAIN_PERIOD_S of wall time."""
        speed = self._speed.of(status)
        if status.wall_s - self._last_s < PLAIN_PERIOD_S:
            return
        self._last_s = status.wall_s
        vehicles = "; ".join(f"{name} {_phase(vehicle)}" for name, vehicle in status.vehicles.items())
        self._print(f"{status.time_s:7.1f} s  {speed:.1f} x real time; {vehicles}")

    def event(self, event: EventTold) -> None:
        """A line."""
        self._print(event_line(event))

    def close(self) -> None:
        """Nothing to put away."""

    def _print(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)


def _phase(vehicle: VehicleProgress) -> str:
    status = vehicle.status
    if status is None:
        return "armed" if vehicle.armed else "disarmed"
    return f"{status.phase} {status.progress:.0%}"


class LiveView:
    """A table that is drawn anew: vehicles, phases, progress, and the last events."""

    def __init__(self, title: str, console: Console) -> None:
        self._title, self._speed = title, Speed()
        self._recent: deque[str] = deque(maxlen=RECENT_EVENTS)
        self._status: Progress | None = None
        self._live = Live(self._drawn(0.0), console=console, refresh_per_second=8, transient=False)
        self._live.start()

    def status(self, status: Progress) -> None:
        """Draw it."""
        self._status = status
        self._live.update(self._drawn(self._speed.of(status)))

    def event(self, event: EventTold) -> None:
        """Shown below the table."""
        if event.event.kind not in QUIET_EVENTS:
            self._recent.append(event_line(event))

    def close(self) -> None:
        """Leave the last picture standing."""
        self._live.stop()

    def _drawn(self, speed: float) -> Group:
        status = self._status
        if status is None:
            return Group(Text(f"{self._title}: starting", style="bold"))
        head = Text.assemble(
            (self._title, "bold"), f"   {status.time_s:.1f} s simulated   ", (f"{speed:.1f} x real time", "cyan")
        )
        table = Table(expand=False, pad_edge=False)
        for column in ("vehicle", "phase", "progress", "north, east, up", "frames", "says"):
            table.add_column(column)
        for name, vehicle in status.vehicles.items():
            table.add_row(*self._row(name, vehicle))
        return Group(head, table, *_lines(self._recent))

    def _row(self, name: str, vehicle: VehicleProgress) -> list[Any]:
        status = vehicle.status
        north, east, up = vehicle.position_m
        phase = status.phase if status else "armed" if vehicle.armed else "disarmed"
        return [
            Text(name, style="bold green" if vehicle.armed else "bold"),
            phase,
            ProgressBar(total=1.0, completed=status.progress, width=16) if status else "",
            f"{north:6.1f} {east:6.1f} {up:5.1f} m",
            "" if vehicle.frames is None else str(vehicle.frames),
            Text(status.text if status else "", overflow="ellipsis", no_wrap=True),
        ]


def _lines(texts: Iterable[str]) -> list[Text]:
    return [Text(text, style="dim", overflow="ellipsis", no_wrap=True) for text in texts]
