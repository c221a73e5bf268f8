"""Who flies the runs of a campaign: threads that each start a process here, or a Dask cluster (`dask_pool.py`)."""

import contextlib
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

from sitl_emu.run.campaign import flight
from sitl_emu.run.campaign.flight import Job, Result

CORES_PER_RUN = 2
"""Ours: world, autopilots, cameras and companions work side by side, and wait for each other."""


class Pool(NamedTuple):
    """Flies jobs."""

    submit: Callable[[Job], Future[Result]]
    stop: Callable[[], None]
    """End what is under way, and begin nothing more."""
    places: int
    """How many runs go on at a time, as far as that is known."""
    about: str
    lacking: Callable[[], str] = str
    """What is missing for any run to begin, a line for people; empty where nothing is."""
    gone: str = ""
    """What is said where runs are cancelled, and it was not `stop`."""


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
