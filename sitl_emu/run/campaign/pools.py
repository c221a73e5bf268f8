"""Who flies the runs of a campaign: threads that each start a process here, or the workers of a Dask cluster.

On a cluster a run is a task: where a worker dies, Dask gives its tasks to another, and the run that it flew ends with
it (`flight.py`). A result is what the task returns, so that workers need no folder in common with the campaign's; where
they have one, run folders are there too, and where the campaign's can't be made, none is kept.
"""

import contextlib
import os
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu import __version__
from sitl_emu.run.addresses import is_port
from sitl_emu.run.campaign import flight
from sitl_emu.run.campaign.flight import Job, Result
from sitl_emu.run.trouble import Trouble

CORES_PER_RUN = 2
"""Ours: world, autopilots, cameras and companions work side by side, and wait for each other."""
ANSWER_S = 10.0
"""How long a scheduler has to answer."""


class Pool(NamedTuple):
    """Flies jobs."""

    submit: Callable[[Job], Future[Result]]
    stop: Callable[[], None]
    """End what is under way, and begin nothing more."""
    places: int
    """How many runs go on at a time, as far as that is known."""
    about: str


def default_workers() -> int:
    """How many runs this machine flies at a time."""
    return max(1, len(os.sched_getaffinity(0)) // CORES_PER_RUN)


@contextlib.contextmanager
def here(workers: int) -> Iterator[Pool]:
    """This machine, so many at a time."""
    over = threading.Event()
    with ThreadPoolExecutor(workers, "run") as executor:

        def stop() -> None:
            over.set()
            executor.shutdown(wait=False, cancel_futures=True)

        try:
            yield Pool(lambda job: executor.submit(flight.fly, job, over.is_set), stop, workers, f"{workers} at a time")
        finally:
            stop()


def check(address: str) -> None:
    """Raise Trouble for what is no address of a Dask scheduler."""
    kind, _, place = address.partition("://")
    host, _, port = place.rpartition(":")
    if kind not in ("tcp", "tls") or not host or not is_port(port):
        raise Trouble(f"--dask {address}: give tcp://HOST:PORT or tls://HOST:PORT, such as tcp://127.0.0.1:8786")


@contextlib.contextmanager
def on_dask(address: str) -> Iterator[Pool]:
    """A Dask cluster by its scheduler's address. Raises Trouble."""
    try:
        import distributed
    except ImportError:
        raise Trouble("--dask: it needs Dask: pip install 'sitl-emu[dask]'") from None
    try:
        client = distributed.Client(address, timeout=ANSWER_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError):
        raise Trouble(
            f"--dask {address}: no scheduler answers there; start one with `dask scheduler`, workers with "
            "`dask worker ADDRESS --nthreads 1`, and give its address, such as tcp://127.0.0.1:8786"
        ) from None
    with client:
        _expect_versions(client, address)
        places = sum(client.nthreads().values())
        executor, over = client.get_executor(pure=False), f"sitl-emu-{uuid.uuid4()}"
        stopping = distributed.Event(over, client=client)

        def stop() -> None:
            stopping.set()
            executor.shutdown(wait=False)

        try:
            about = f"{places} at a time on the Dask cluster at {address}"
            yield Pool(lambda job: executor.submit(_fly_on_worker, job, over), stop, max(places, 1), about)
        finally:
            stop()


def _fly_on_worker(job: Job, over: str) -> Result:
    """A task."""
    import distributed

    return fly_where_it_can(job, distributed.Event(over).is_set)


def fly_where_it_can(job: Job, stopping: flight.Stopping) -> Result:
    """Fly a job in its folder, or in a temporary one where this machine can't make that: then for its result alone."""
    try:
        Path(job.folder).parent.mkdir(parents=True, exist_ok=True)
    except OSError:
        with tempfile.TemporaryDirectory(prefix="sitl-emu-") as folder:
            return flight.fly(job._replace(folder=str(Path(folder) / "run"), keep="none"), stopping)
    return flight.fly(job, stopping)


def _expect_versions(client: Any, address: str) -> None:
    """Raise Trouble for workers that would fly something else."""
    for worker, version in client.run(_version, on_error="return").items():
        if version != __version__:
            has = f"sitl-emu {version}" if isinstance(version, str) else f"no sitl-emu ({version})"
            raise Trouble(f"--dask {address}: worker {worker} has {has}; this is {__version__}: install it there")


def _version() -> str:
    return __version__
