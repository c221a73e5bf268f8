"""`sitl-emu run`: starts the processes of a scenario, shows how they do, and ends them all whatever happens.

World, cameras, autopilots and companions are processes of their own, joined by control channels that they inherit. When
one dies, the launcher says which, and ends the rest; Ctrl-C, SIGTERM and a terminal that is closed end them too. Each
writes what it has to complain about into `logs/` of the run's folder.
"""

import contextlib
import select
import signal
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

from sitl_emu.run import wiring
from sitl_emu.run.children import STOP_S, Child, end_all, kill, obituary
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.live_view import View
from sitl_emu.run.messages import CommandEnded, EventTold, Kill, Killed, Listening, Over, Progress, Stop
from sitl_emu.run.process import ending_signals
from sitl_emu.run.trouble import Trouble, unwritable

POLL_S = 0.1
FINISH_S = 20.0
"""How long processes have after a good end, to make their logs whole on a busy machine."""
DYING_S = 5.0
"""How long a process that has closed its sockets may take until it has ended; ours."""


@dataclass
class Ending:
    """How a run ended."""

    outcome: str
    over: Over | None = None
    """What the world process said of it; None where it did not come to that."""
    truth: Mapping[str, Any] = field(default_factory=dict)
    home: tuple[float, ...] = ()
    complaint: str = ""
    """What went wrong with a process, for people; empty where nothing did."""
    accident: bool = False
    """Whether a process was killed or hung: the machine's doing, not the mission's; another try may go well."""
    refused: bool = False
    """Whether a process could not be set up or could not write: the user can put that right."""


class Stopped(Exception):
    """Ctrl-C, SIGTERM, or a terminal that was closed."""


def run(wanted: wiring.Wanted, view: View) -> Ending:
    """Make a run that `preflight.check` has let pass, from its first process to the end of the last.

    Raises Trouble where it can't be started.
    """
    children: list[Child] = []
    ending = Ending("interrupted")
    with _stoppable() as stop:
        try:
            world = _start(wanted, children)
            try:
                with stop.heard():
                    _watch(world, children, view, ending)
            except Stopped:
                _stop(world, ending)
        finally:
            end_all(children, FINISH_S if ending.over and not ending.over.lost else STOP_S)
            wiring.remove_rings(wanted)
    return ending


def _start(wanted: wiring.Wanted, children: list[Child]) -> ControlChannel:
    """See `wiring.start`. Raises Trouble."""
    try:
        for name in ("logs", "frames"):
            (wanted.folder / name).mkdir()
        return wiring.start(wanted, children)
    except OSError as error:
        if error.filename is not None:
            raise unwritable(wanted.folder, error) from None
        raise Trouble(
            f"the run's processes can't be started: {error.strerror}; `ulimit -a` shows what this user may have "
            "(processes, open files, memory)"
        ) from None


class _Stop:
    """What signals do: they raise Stopped while they are heard, and wait until they are.

    Nobody hears them while a process is started, which else were in no list yet, and while all are ended.
    """

    def __init__(self) -> None:
        self._asked = self._heard = False

    def ask(self, _number: int, _frame: FrameType | None) -> None:
        """A signal's handler."""
        self._asked = True
        if self._heard:
            raise Stopped

    @contextlib.contextmanager
    def heard(self) -> Iterator[None]:
        """Raise Stopped in the body, and before it where a signal has come by then."""
        self._heard = True
        try:
            if self._asked:
                raise Stopped
            yield
        finally:
            self._heard = False


@contextlib.contextmanager
def _stoppable() -> Iterator[_Stop]:
    """Let signals stop the run."""
    stop = _Stop()
    before = {number: signal.signal(number, stop.ask) for number in ending_signals()}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _watch(world: ControlChannel, children: list[Child], view: View, ending: Ending) -> None:
    """Pass on to the view what the world says, until the run is over or a process has died."""
    told = set[str]()
    while True:
        select.select([world], [], [], POLL_S)
        try:
            while (message := world.poll()) is not None:
                if isinstance(message, Progress):
                    view.status(message)
                elif isinstance(message, EventTold):
                    view.event(message)
                elif isinstance(message, Listening):
                    ending.truth, ending.home = message.truth, message.home
                elif isinstance(message, Kill):
                    _kill(message.title, children)
                    world.send(Killed(message.title))
                elif isinstance(message, Over):
                    ending.over, ending.outcome = message, message.outcome
                    if message.lost:
                        _blame(ending, children, message.lost)
                    return
            for child in children:
                status = child.process.poll()
                if status is None or child.title in told or child.killed:
                    continue
                if child.command:
                    told.add(child.title)
                    if status:
                        ending.complaint = "\n".join(filter(None, (ending.complaint, obituary(child))))
                    world.send(CommandEnded(child.title.removeprefix("companion "), status))
                elif child.title != "world":
                    _blame(ending, children, f"{child.title} has ended")
                    return
        except ProcessLostError:
            _blame(ending, children, "the world process has gone")
            return


def _kill(title: str, children: list[Child]) -> None:
    """Kill a process because a fault of the scenario says so: none of the run's accidents."""
    child = next(child for child in children if child.title == title)
    child.killed = True
    kill(child)


def _stop(world: ControlChannel, ending: Ending) -> None:
    """Ask the world to make an end, and what its figures are."""
    until = time.monotonic() + STOP_S / 2
    with contextlib.suppress(ProcessLostError):
        world.send(Stop("interrupted"))
        while time.monotonic() < until:
            select.select([world], [], [], POLL_S)
            while (message := world.poll()) is not None:
                if isinstance(message, Over):
                    ending.over = message
                    return


def _blame(ending: Ending, children: list[Child], lost: str) -> None:
    """Name the process that died first: one that was killed or failed, rather than one that ended for want of it.

    Its sockets are closed before its exit status is there, on a busy machine by seconds.
    """
    until = time.monotonic() + DYING_S
    while not (dead := [each for each in children if each.failed]) and time.monotonic() < until:
        time.sleep(0.02)
    if not dead:
        ending.complaint, ending.accident = lost, True
    else:
        child = min(dead, key=lambda child: child.process.returncode)
        ending.complaint = obituary(child)
        ending.accident = child.process.returncode < 0
        ending.refused = child.explained
    ending.outcome = ending.complaint.splitlines()[0]
