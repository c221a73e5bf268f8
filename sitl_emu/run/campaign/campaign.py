"""`sitl-emu campaign`: plans the runs, has those flown that are not there yet, and makes tables and a report of all.

The same command goes on where it ended: its folder is found again by what it flies (`store.py`). Runs go through the
seeds, and for each through the arms, so that arms grow evenly.
"""

import contextlib
import functools
import importlib.util
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from rich.console import Console

from sitl_emu.missions import registry
from sitl_emu.missions.companion.swarm.key import MOST_SEED
from sitl_emu.missions.mission import Mission
from sitl_emu.missions.reporting import Section, Table
from sitl_emu.run import checks, preflight
from sitl_emu.run.campaign import dask_pool, inputs, pools, store
from sitl_emu.run.campaign.arms import Arm, arms_of, variation
from sitl_emu.run.campaign.flight import Job, Keep, Result
from sitl_emu.run.campaign.pools import Pool
from sitl_emu.run.campaign.progress import CampaignView
from sitl_emu.run.campaign.store import Store
from sitl_emu.run.process import ending_signals
from sitl_emu.run.scenario import Scenario, find
from sitl_emu.run.trouble import Trouble

NEEDED = {"scipy": "intervals", "arro3.io": "Parquet"}
EXIT_WHOLE, EXIT_PART, EXIT_STOPPED = 0, 1, 130
"""130 as shells have it for Ctrl-C."""
STOPPED = "stopped; the same command goes on"
AGAIN = "begin again in a new folder, with --out"
LOOK_S = 0.5
"""How often Ctrl-C is looked for."""
Look = Callable[[], Mapping[str, str]]


class Wanted(NamedTuple):
    """A campaign to be flown."""

    scenario: str
    """A name or a file."""
    runs: int
    """Of each arm."""
    vary: Sequence[str] = ()
    seed: int | None = None
    """Of each arm's first run; None: the scenario's."""
    workers: int | None = None
    dask: str | None = None
    out: Path | None = None
    keep: Keep = "all"


def campaign(wanted: Wanted, console: Console) -> int:
    """Fly it; 0 when all runs are there, however they ended, 130 when it was stopped. Raises Trouble."""
    _expect_extras()
    if wanted.dask is not None:
        dask_pool.check(wanted.dask)
    path = find(wanted.scenario)
    arms = arms_of(path, [variation(text) for text in wanted.vary])
    seed = arms[0].scenario.seed if wanted.seed is None else wanted.seed
    if seed + wanted.runs - 1 > MOST_SEED:
        raise Trouble(
            f"campaign: --runs {wanted.runs} from seed {seed} on: the largest is {MOST_SEED}; take a smaller --seed"
        )
    isolated, look = _checked(arms, seed, path, wanted)
    identity = store.identity_of(path.stem, seed, arms, look())
    folder = wanted.out or Path("runs") / f"campaign-{path.stem}-{identity.digest}"
    with store.opened(folder, identity, arms) as kept:
        if kept.doubt:
            _say(console, f"sitl-emu: {kept.doubt}")
        wanted_runs = [(arm, seed + number) for number in range(wanted.runs) for arm in arms]
        jobs = [
            Job(arm.name, one, arm.data, str(kept.run_folder(arm.name, one)), isolated, wanted.keep)
            for arm, one in wanted_runs
            if kept.kept(arm.name, one) is None
        ]
        planned = f"{_count(len(wanted_runs), 'run')} in {_count(len(arms), 'arm')}"
        _say(console, f"{planned}, {len(wanted_runs) - len(jobs)} there; {folder}")
        missing = _flown(jobs, wanted, kept, console, len(wanted_runs)) if jobs else []
        if jobs and (changed := store.changed(identity.contents, look())):
            missing.append(f"{changed} changed while runs were flown, which have read the one or the other: {AGAIN}")
        there = [result for arm, one in wanted_runs if (result := kept.kept(arm.name, one)) is not None]
        _conclude(kept, identity.name, arms, there, len(wanted_runs), missing, console)
    if STOPPED in missing:
        return EXIT_STOPPED
    return EXIT_WHOLE if len(there) == len(wanted_runs) and not missing else EXIT_PART


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _expect_extras() -> None:
    """Raise Trouble where what makes tables and intervals is not there: before hours of flying."""
    for module, what in NEEDED.items():
        if importlib.util.find_spec(module.partition(".")[0]) is None:
            raise Trouble(f"campaign: its {what} need {module}: pip install 'sitl-emu[campaign]'")


def _checked(arms: Sequence[Arm], seed: int, path: Path, wanted: Wanted) -> tuple[bool, Look]:
    """Whether runs keep to themselves, and how to look at what they read. Trouble for an arm that can't be flown."""
    commands = [vehicle.name for arm in arms for vehicle in arm.scenario.vehicles if _by_command(vehicle)]
    if commands and (wanted.dask is not None or (wanted.workers or 1) > 1):
        raise Trouble(
            f"campaign: {commands[0]} has a command as its autopilot or companion, which finds its vehicle by PX4's "
            "ports: such runs can't go on side by side; leave out --dask and --workers"
        )
    files, programs = set[Path](), set[str]()
    for arm in arms:
        # a copy: checks let missions prepare their options
        world = checks.check(arm.scenario.model_copy(deep=True), seed, path.with_name(f"{path.name} ({arm.name})"))
        preflight.check(arm.scenario, 0, isolated=not commands)
        files |= inputs.files_of(arm.scenario, world)
        programs |= inputs.programs_of(arm.scenario)
    return not commands, functools.partial(inputs.contents, files, programs)


def _by_command(vehicle: object) -> bool:
    return any(getattr(getattr(vehicle, part), "command", None) for part in ("autopilot", "companion"))


def _flown(jobs: Sequence[Job], wanted: Wanted, kept: Store, console: Console, planned: int) -> list[str]:
    """Have jobs flown; what became of those that are not there, a line each. Raises Trouble."""
    workers = 1 if not jobs[0].isolated else wanted.workers or pools.default_workers()
    opened = dask_pool.on_dask(wanted.dask) if wanted.dask is not None else pools.here(min(workers, len(jobs)))
    missing = list[str]()
    # the pool first: while a cluster is waited for, Ctrl-C and SIGTERM end this process, as anywhere
    with opened as pool, _stoppable() as stopped:
        _say(console, pool.about)
        view = CampaignView(console, planned, planned - len(jobs), pool.places)
        try:
            missing += _collected(jobs, pool, kept, view, stopped)
        finally:
            view.close()
    if stopped.is_set():
        missing.append(STOPPED)
    return missing


def _collected(jobs: Sequence[Job], pool: Pool, kept: Store, view: CampaignView, stopped: threading.Event) -> list[str]:
    """Keep results as they come; a line for each run that has none, but for those that a stop has kept from it.

    What this campaign has not stopped, and is cancelled, was taken from it with all the others.
    """
    missing, refused, lacking = list[str](), False, ""
    waiting = {pool.submit(job): job for job in jobs}
    try:
        while waiting:
            wait(waiting, return_when=FIRST_COMPLETED, timeout=LOOK_S)
            if stopped.is_set() or refused:
                pool.stop()
            elif (told := pool.lacking()) != lacking:
                lacking = told
                view.say(told or "it goes on")
            for future in [one for one in waiting if one.done()]:  # `wait` does not know those that a stop cancels
                result = _result_of(future, waiting.pop(future))
                if future.cancelled() and not (stopped.is_set() or refused):
                    refused = True
                    missing.append(pool.gone)
                if result.summary is not None:
                    kept.keep(result)
                if not result.stopped:
                    view.ended(result)
                if result.refused and not refused:
                    refused = True
                    missing.append(f"{result.arm}, seed {result.seed}: {result.refused}")
                elif result.accident:
                    missing.append(f"{result.arm}, seed {result.seed}, tried {result.tries} times: {result.accident}")
    finally:
        pool.stop()
    return missing


def _result_of(future: "Future[Result]", job: Job) -> Result:
    """What a job came to; a worker that has died again and again is an accident."""
    if future.cancelled():
        return Result(job.arm, job.seed, stopped=True)
    error = future.exception()
    if error is None:
        return Result(*future.result())
    return Result(job.arm, job.seed, accident=" ".join(f"{type(error).__name__}: {error}".split()))


@contextlib.contextmanager
def _stoppable() -> Iterator[threading.Event]:
    """An event that Ctrl-C, SIGTERM and a terminal that is closed set."""
    stopped = threading.Event()

    def stop(_number: int, _frame: FrameType | None) -> None:
        stopped.set()

    before = {number: signal.signal(number, stop) for number in ending_signals()}
    try:
        yield stopped
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _conclude(
    kept: Store,
    name: str,
    arms: Sequence[Arm],
    there: Sequence[Result],
    planned: int,
    missing: Sequence[str],
    console: Console,
) -> None:
    """Tables, report, and what is printed. Raises Trouble."""
    from sitl_emu.run.campaign import report, tables

    by_name = {arm.name: arm for arm in arms}
    if there:
        tables.write(kept.folder, there, by_name)
    outcome = report.Outcome(name, by_name, there, planned, missing, _missions(arms[0].scenario))
    sections = report.sections_of(outcome)
    page = report.write(kept, outcome, sections)
    for section in sections:
        _show(console, section)
    _say(console, "")
    for line in missing:
        _say(console, f"sitl-emu: {line}")
    _say(console, f"{len(there)} of {planned} runs are there")
    _say(console, f"report: {page}")


def _missions(scenario: Scenario) -> list[Mission]:
    parts = [vehicle.companion for vehicle in scenario.vehicles if vehicle.companion is not None]
    return registry.missions_of([part.mission for part in parts if part.mission is not None])


def _show(console: Console, section: Section) -> None:
    """A section's tables."""
    for table in (part for part in section.parts if isinstance(part, Table)):
        rows = [["–" if cell is None else str(cell) for cell in row] for row in (table.head, *table.rows)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        _say(console, f"\n{section.title}")
        for row in rows:
            _say(console, "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def _say(console: Console, line: str) -> None:
    console.print(line, markup=False, highlight=False, soft_wrap=True)
