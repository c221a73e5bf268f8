"""The workers of a Dask cluster fly the runs of a campaign: a run is a task.

Where a worker dies, Dask gives its tasks to another, and the run that it flew ends with it (`flight.py`). A result is
what the task returns, so that workers need no folder in common with the campaign's; where they have one, run folders
are there too, and where the campaign's can't be made, none is kept.
"""

import asyncio
import contextlib
import logging
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from sitl_emu import __version__
from sitl_emu.run.addresses import is_port
from sitl_emu.run.campaign import flight
from sitl_emu.run.campaign.flight import Job, Result
from sitl_emu.run.campaign.pools import Pool
from sitl_emu.run.trouble import Trouble

ANSWER_S = 10.0
"""Ours: how long a scheduler, and its workers, have to answer."""
TLS = "tls://"


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
    _expect_tls(address)
    try:
        _expect_scheduler(address)
        client = distributed.Client(address, timeout=ANSWER_S, set_as_default=False)
    except Exception:  # whatever becomes of bytes that another program sends
        fitting = " that the certificates of distributed.comm.tls fit" if address.startswith(TLS) else ""
        raise Trouble(
            f"--dask {address}: no scheduler answers there{fitting}; start one with `dask scheduler`, workers with "
            "`dask worker ADDRESS --nthreads 1`, and give its address, such as tcp://127.0.0.1:8786"
        ) from None
    for name in ("distributed", "distributed.client"):  # a scheduler that has gone is told in a line, not in tracebacks
        logging.getLogger(name).setLevel(logging.CRITICAL)
    with client:
        _expect_versions(client, address)
        places = sum(_answer(client, client.nthreads).values())
        executor, over = client.get_executor(pure=False), f"sitl-emu-{uuid.uuid4()}"
        stopping, told = distributed.Event(over, client=client), threading.Event()

        def submit(job: Job) -> "Future[Result]":
            submitted: Future[Result] = executor.submit(_fly_on_worker, job, over, __version__)
            return submitted

        def stop() -> None:
            # once, and not where the scheduler has gone: each time would be waited for
            if client.status == "running" and not told.is_set():
                told.set()
                with contextlib.suppress(Trouble):
                    _answer(client, stopping.set)
            executor.shutdown(wait=False)

        def lacking() -> str:
            with contextlib.suppress(Trouble):
                if client.status == "running" and not _answer(client, client.nthreads):
                    return f"--dask {address}: no workers there: start `dask worker {address} --nthreads 1`"
            return ""

        about = f"{places} at a time on the Dask cluster at {address}"
        gone = f"--dask {address}: the scheduler has gone; the same command goes on"
        try:
            yield Pool(submit, stop, max(places, 1), about, lacking, gone)
        finally:
            stop()


def _answer(client: Any, ask: Callable[[], Any]) -> Any:
    """What a client's method answers, whose own wait has no end. Raises Trouble."""

    async def asked() -> Any:
        return await ask()

    try:
        return client.sync(asked, callback_timeout=ANSWER_S)
    except OSError:  # of which TimeoutError is one
        address = client.scheduler.address
        raise Trouble(f"--dask {address}: its scheduler or a worker does not answer; end the one that hangs") from None


def _fly_on_worker(job: Job, over: str, version: str) -> Result:
    """A task; `version`: the campaign's, as workers join that were not there when it began."""
    import distributed

    if version != __version__:
        told = _differs(distributed.get_worker().address, __version__, version)
        return Result(job.arm, job.seed, refused=f"{told}, and the same command goes on")
    event = distributed.Event(over)

    def is_over() -> bool:
        with contextlib.suppress(OSError):  # a worker whose scheduler has gone ends, and its runs with it
            return bool(event.is_set())
        return False

    return fly_where_it_can(job, is_over)


def fly_where_it_can(job: Job, stopping: flight.Stopping) -> Result:
    """Fly a job in its folder, or in a temporary one where this machine can't make that: then for its result alone."""
    try:
        Path(job.folder).parent.mkdir(parents=True, exist_ok=True)
    except OSError:
        with tempfile.TemporaryDirectory(prefix="sitl-emu-") as folder:
            return flight.fly(job._replace(folder=str(Path(folder) / "run"), keep="none"), stopping)
    return flight.fly(job, stopping)


def _expect_tls(address: str) -> None:
    """Raise Trouble where an address asks for TLS, and Dask's configuration lacks what a client needs for it."""
    import distributed

    if not address.startswith(TLS):
        return
    security = distributed.Security()
    needed = {"ca-file": security.tls_ca_file, "client.cert": security.tls_client_cert}
    if missing := [f"distributed.comm.tls.{name}" for name, value in needed.items() if not value]:
        raise Trouble(
            f"--dask {address}: TLS needs {' and '.join(missing)} in Dask's configuration "
            "(https://distributed.dask.org/en/stable/tls.html)"
        )
    try:
        security.get_connection_args("client")
    except OSError as error:  # also of ssl
        named = "distributed.comm.tls.ca-file, client.cert and client.key"
        raise Trouble(f"--dask {address}: TLS can't read what {named} name: {error}") from None


def _expect_scheduler(address: str) -> None:
    """Raise an exception where no scheduler says who it is.

    Asked before there is a Client, whose `timeout` leaves out the handshake (distributed 2026.8, comm/core.py,
    `connect`): beside a program that takes the connection and says nothing it waits without end.
    """
    import distributed

    own = distributed.Security().get_connection_args("client")  # of Dask's configuration, as Client has it

    async def asked() -> Mapping[str, Any]:
        async with distributed.rpc(address, timeout=ANSWER_S, connection_args=own) as scheduler:
            said: Mapping[str, Any] = await scheduler.identity()
            return said

    if "workers" not in asyncio.run(asyncio.wait_for(asked(), ANSWER_S)):
        raise ValueError("a worker, which has no workers of its own")


def _expect_versions(client: Any, address: str) -> None:
    """Raise Trouble for workers that would fly something else."""
    for worker, version in _answer(client, lambda: client.run(_version, on_error="return")).items():
        if version != __version__:
            raise Trouble(f"--dask {address}: {_differs(worker, version, __version__)}")


def _differs(worker: str, version: object, wanted: str) -> str:
    """That a worker has another sitl-emu than a campaign, or none."""
    has = f"sitl-emu {version}" if isinstance(version, str) else f"no sitl-emu ({version})"
    return f"worker {worker} has {has}; the campaign's is {wanted}: install it there"


def _version() -> str:
    return __version__
