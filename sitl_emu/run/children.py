"""The processes of a run: how one is started, what is said of one that has died, and how all are ended."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from sitl_emu.run import configs
from sitl_emu.run.process import EXIT_EXPLAINED, signal_name
from sitl_emu.run.trouble import Trouble

STOP_S = 2.0
"""How long processes have to end by themselves when a run goes wrong; then they get SIGTERM, and at last SIGKILL."""
LOG_LINES, LOG_BYTES = 12, 1 << 14
"""As much of a log's end is told."""
THRIFT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "1",
    "MALLOC_MMAP_THRESHOLD_": str(1 << 30),
    "MALLOC_TRIM_THRESHOLD_": str(1 << 32),
}
"""The processes share the cores: numerical libraries that each take them all would only be in each other's way. And
the C library (glibc) is told to keep the memory of a frame for the next one: handing it back and fetching it anew
made 3000 page faults a frame, a third of a detector's time."""


@dataclass
class Child:
    """A process of the run."""

    title: str
    process: subprocess.Popen[bytes]
    log: Path
    command: bool = False
    """A companion of the user's; it may end when it likes."""
    outside: bool = False
    """An autopilot from outside: it does not see by itself that the run is over."""
    killed: bool = False
    """By a fault of the scenario."""

    @property
    def explained(self) -> bool:
        """Whether it is one of ours and has ended with its last line as the reason."""
        return self.process.returncode == EXIT_EXPLAINED and not self.command and not self.outside

    @property
    def failed(self) -> bool:
        """Whether it has ended as no process of a run should; a companion of the user's may."""
        return bool(self.process.poll()) and not self.command and not self.killed


def start_process(title: str, module: str, config: configs.ProcessConfig, end: socket.socket, folder: Path) -> Child:
    """One of ours, `sitl_emu.run.MODULE`, with its end of the control channel; it logs in `folder`.

    What it is told is its standard input: an argument holds 128 KiB, and an area of many corners is more. Title and
    folder are arguments for people, who see in a list of processes which is what.
    """
    log = folder / "logs" / f"{title.replace(' ', '-')}.log"
    arguments = [sys.executable, "-P", "-m", f"sitl_emu.run.{module}", str(end.fileno()), title, str(folder)]
    with log.open("wb") as output, _in_memory(configs.written(config)) as told:
        process = subprocess.Popen(
            arguments,
            stdin=told,
            stdout=output,
            stderr=subprocess.STDOUT,
            pass_fds=[end.fileno(), *config.fds],
            start_new_session=True,
            env={**os.environ, **THRIFT},
        )
    return Child(title, process, log)


def _in_memory(text: str) -> BinaryIO:
    """A file without a name, to be read from its beginning."""
    file = os.fdopen(os.memfd_create("sitl_emu-told"), "w+b")
    file.write(text.encode())
    file.seek(0)
    return file


def start_command(
    title: str, arguments: Sequence[str], more_env: Mapping[str, str], folder: Path, *, autopilot: bool = False
) -> Child:
    """A program of the user's, a companion or an autopilot, with additions to the environment.

    Raises Trouble if there is no such program.
    """
    log = folder / "logs" / f"{title.replace(' ', '-')}.log"
    with log.open("wb") as output:
        try:
            process = subprocess.Popen(
                arguments,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                env={**os.environ, **more_env},
            )
        except OSError as error:
            raise Trouble(f"{title}: can't start {arguments[0]!r}: {error.strerror}") from None
    return Child(title, process, log, command=not autopilot, outside=autopilot)


def kill(child: Child) -> None:
    """By SIGKILL, with whatever it has started; returns when it is dead."""
    _signal_group(child, signal.SIGKILL)
    child.process.wait()


def obituary_of_lost(child: Child) -> str:
    """`obituary` of one that has hung up: it has STOP_S to end by itself, then it is killed."""
    try:
        child.process.wait(STOP_S)
    except subprocess.TimeoutExpired:
        kill(child)
        lingered = f"{child.title} (pid {child.process.pid}) hung up, and was killed as it did not end"
        return f"{lingered}; its log is {child.log}"
    return obituary(child)


def obituary(child: Child) -> str:
    """How it ended, and the last that it said."""
    status = child.process.returncode
    if status < 0:
        how = f"{child.title} (pid {child.process.pid}) was killed by {signal_name(-status)}"
        return f"{how}; its log is {child.log}"
    last = _last_lines(child.log)
    if child.explained:
        return f"{child.title}: {last[-1] if last else f'{child.log} has no room for why it ended'}"
    said = "".join(f"\n  {line}" for line in last)
    how = f"{child.title} (pid {child.process.pid}) ended with exit status {status}"
    return f"{how}; its log {child.log} ends:{said}" if said else f"{how} without a word"


def _last_lines(log: Path) -> list[str]:
    """Of a log that a program of the user's may have made as long as the disk."""
    with log.open("rb") as file:
        file.seek(max(0, os.fstat(file.fileno()).st_size - LOG_BYTES))
        return file.read(LOG_BYTES).decode(errors="replace").strip().splitlines()[-LOG_LINES:]


def end_all(children: list[Child], patience_s: float) -> None:
    """End all processes: by themselves when they see the world go, then by SIGTERM, then by SIGKILL."""
    users = [child for child in children if child.command or child.outside]
    _signal([*users, *(child for child in children if child.title == "world")], signal.SIGTERM)
    if not _wait(children, patience_s):
        _signal(children, signal.SIGTERM)
        if not _wait(children, STOP_S / 2):
            _signal(children, signal.SIGKILL)
            _wait(children, STOP_S)
    _end_left(users)


def _end_left(users: list[Child]) -> None:
    """End what programs of the user's have started and left behind, such as a script's `node &`."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        until = time.monotonic() + STOP_S / 2
        for child in users:
            _signal_group(child, number)
        while any(_signal_group(child, 0) for child in users) and time.monotonic() < until:
            time.sleep(0.02)


def _signal_group(child: Child, number: int) -> bool:
    """Whether there was anybody to get it."""
    try:
        os.killpg(child.process.pid, number)
    except (ProcessLookupError, PermissionError):
        return False
    return True


def _signal(children: list[Child], number: signal.Signals) -> None:
    for child in children:
        if child.process.poll() is None:
            _signal_group(child, number)


def _wait(children: list[Child], limit_s: float) -> bool:
    until = time.monotonic() + limit_s
    for child in children:
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.process.wait(max(0.0, until - time.monotonic()))
    return all(child.process.poll() is not None for child in children)
