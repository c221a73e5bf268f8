"""One run of a campaign: a process of its own, from a job to a result; also what a Dask worker does.

The process is `python -m sitl_emu.run.campaign.flight_process`, which reads the job as a line of JSON and goes on until
its standard input is closed: so a run ends with whoever asked for it, even by SIGKILL. It flies in a folder beside the
one that it is for, which is renamed when all is written: a run's folder is whole, or not there.
A run whose process was killed or hung was an accident of the machine's and says nothing about the mission: it is flown
again, `MOST_TRIES` times in all. A mission that fails, also by an exception in its companion, is a result.
"""

import contextlib
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

from sitl_emu.run.score import EXIT_FAILED, EXIT_SUCCESS

EXIT_ACCIDENT, EXIT_REFUSED = 4, 2
"""Exit status of the process beside a run's own; its last line says what happened."""
MOST_TRIES = 3
LOOK_S = 0.5
"""How often a run that goes on asks whether it is to stop."""
PATIENCE_S = 60.0
"""How long a run has to end when it is told to: it writes its report on a busy machine."""
LOG, SUMMARY = "console.txt", "summary.json"
Keep = Literal["all", "failed", "none"]
Stopping = Callable[[], bool]
"""Whether the campaign is over before its end."""


class Job(NamedTuple):
    """A run to be flown."""

    arm: str
    seed: int
    scenario: Mapping[str, Any]
    """As its file has it."""
    folder: str
    """Where the run is to be."""
    isolated: bool = True
    keep: Keep = "all"


class Result(NamedTuple):
    """How a job ended."""

    arm: str
    seed: int
    summary: Mapping[str, Any] | None = None
    """The run's summary.json; None where there was no run that counts."""
    accident: str = ""
    """What kept it from being flown, and may not the next time."""
    refused: str = ""
    """What keeps it from being flown, and will again until somebody puts it right; such as a full disk."""
    stopped: bool = False
    tries: int = 1
    wall_s: float = 0.0
    host: str = ""


def fly(job: Job, stopping: Stopping) -> Result:
    """Fly a job, again after an accident."""
    result = Result(job.arm, job.seed)
    for tries in range(1, MOST_TRIES + 1):
        started_s = time.monotonic()
        result = _flown(job, stopping)._replace(tries=tries, host=platform.node())
        result = result._replace(wall_s=round(time.monotonic() - started_s, 1))
        if not result.accident or stopping():
            break
    return result


def _flown(job: Job, stopping: Stopping) -> Result:
    """One try."""
    none, folder = Result(job.arm, job.seed), Path(job.folder)
    part = folder.with_name(f"{part_prefix(folder.name)}{uuid.uuid4().hex[:8]}")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile() as said:
            status, stopped = _run(job, part, said, stopping)
            said.seek(0)
            console = said.read()
        if stopped:
            return none._replace(stopped=True)
        if status not in (EXIT_SUCCESS, EXIT_FAILED) or not (part / SUMMARY).is_file():
            last = console.decode(errors="replace").strip().splitlines()[-1:] or ["it said nothing"]
            if status == EXIT_REFUSED:
                return none._replace(refused=last[0])
            return none._replace(accident=last[0] if status == EXIT_ACCIDENT else _how(status, last[0]))
        (part / LOG).write_bytes(console)
        summary = json.loads((part / SUMMARY).read_text())
        if job.keep == "all" or (job.keep == "failed" and status == EXIT_FAILED):
            shutil.rmtree(folder, ignore_errors=True)
            part.rename(folder)
        return none._replace(summary=summary)
    except OSError as error:
        return none._replace(refused=f"can't write {error.filename or folder}: {error.strerror or error}")
    finally:
        shutil.rmtree(part, ignore_errors=True)


def part_prefix(name: str) -> str:
    """What the names of folders begin with in which a run is under way that will be called so."""
    return f".{name}-"


def _run(job: Job, part: Path, said: Any, stopping: Stopping) -> tuple[int, bool]:
    """The process, from its start to its end: exit status, and whether it was told to stop."""
    command = [sys.executable, "-P", "-m", "sitl_emu.run.campaign.flight_process"]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=said, stderr=subprocess.STDOUT, start_new_session=True
    )
    assert process.stdin is not None
    stopped = False
    try:
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(json.dumps(job._replace(folder=str(part))._asdict()).encode() + b"\n")
            process.stdin.flush()
        while not stopped:
            with contextlib.suppress(subprocess.TimeoutExpired):
                return process.wait(LOOK_S), False
            stopped = stopping()
    finally:
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
        _end(process)
    return process.returncode, stopped


def _end(process: subprocess.Popen[bytes]) -> None:
    """It ends by itself once its input is closed; if it does not, it is killed."""
    try:
        process.wait(PATIENCE_S)
    except subprocess.TimeoutExpired:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _how(status: int, last: str) -> str:
    """What is said of a process that ended by itself."""
    how = f"killed by {signal.Signals(-status).name}" if status < 0 else f"exit status {status}"
    return f"the run's launcher: {how}: {last}"
