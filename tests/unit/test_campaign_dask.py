"""A campaign and its Dask cluster: what is said of one that is not there, and of one that goes away."""

import asyncio
import contextlib
import json
import shutil
import signal
import socket
import subprocess
import threading
from collections.abc import Iterator
from concurrent.futures import Future, wait
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import dask
import distributed
import pytest
import yaml
from typer.testing import CliRunner

from sitl_emu import __version__
from sitl_emu.cli import app
from sitl_emu.run.campaign import campaign as campaigns
from sitl_emu.run.campaign import dask_pool, pools
from sitl_emu.run.campaign.flight import Job, Result
from sitl_emu.run.campaign.pools import Pool
from sitl_emu.run.trouble import Trouble

LIMIT_S = 60.0
SCENARIO = {"name": "two", "world": "flat", "vehicles": [{"name": "uas", "model": "iris"}]}
NO_SCHEDULER = "no scheduler answers there; start one with `dask scheduler`"


def flown(folder: Path, *words: str) -> tuple[int, str]:
    """Exit status and what is said of a campaign of a scenario without a companion."""
    path = folder / "two.yaml"
    path.write_text(yaml.safe_dump(SCENARIO))
    done = CliRunner().invoke(app, ["campaign", str(path), "--out", str(folder / "c"), *words])
    return done.exit_code, " ".join(done.output.split())


@contextlib.contextmanager
def another_program(says: bytes) -> Iterator[str]:
    """The address of one that takes connections, and says this or nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server, contextlib.ExitStack() as taken:

        def serve() -> None:
            with contextlib.suppress(OSError):  # of the end
                while True:
                    connection = taken.enter_context(server.accept()[0])
                    connection.sendall(says)

        if says:
            threading.Thread(target=serve, daemon=True).start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with contextlib.suppress(OSError):
            server.shutdown(socket.SHUT_RDWR)


@pytest.fixture
def cluster() -> Iterator[Any]:
    """A scheduler without workers, in this process."""
    with distributed.LocalCluster(
        n_workers=0, processes=False, protocol="tcp", host="127.0.0.1", dashboard_address=None
    ) as started:
        yield started


def test_a_scheduler_that_is_not_there_is_named_with_how_to_start_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_pool, "ANSWER_S", 0.5)
    status, text = flown(tmp_path, "--runs", "1", "--dask", "tcp://127.0.0.1:9")
    assert status == 2 and f"--dask tcp://127.0.0.1:9: {NO_SCHEDULER}" in text


@pytest.mark.parametrize("says", [b"", b"SSH-2.0-OpenSSH_9.6\r\n"])
def test_another_program_at_the_address_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, says: bytes
) -> None:
    """Dask's own time limit leaves out its handshake: a program that says nothing was waited for without end."""
    monkeypatch.setattr(dask_pool, "ANSWER_S", 0.5)
    with another_program(says) as address:
        status, text = flown(tmp_path, "--runs", "1", "--dask", address)
    assert status == 2 and f"--dask {address}: {NO_SCHEDULER}" in text


def test_ctrl_c_and_sigterm_end_a_campaign_that_waits_for_its_cluster(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Until there is a pool, signals do what they do elsewhere; then they end runs."""
    during = list[object]()

    @contextlib.contextmanager
    def opened(_workers: int) -> Iterator[Pool]:
        during.append(signal.getsignal(signal.SIGTERM))
        signal.raise_signal(signal.SIGINT)
        yield Pool(lambda job: pytest.fail(f"{job.arm}: flown"), lambda: None, 1, "here")

    monkeypatch.setattr(pools, "here", opened)
    before = signal.getsignal(signal.SIGTERM)
    status, _ = flown(tmp_path, "--runs", "1")
    assert status == 130 and during == [before]


def test_a_scheduler_that_goes_away_takes_its_runs_along_and_is_not_waited_for(tmp_path: Path, cluster: Any) -> None:
    with dask_pool.on_dask(cluster.scheduler_address) as pool:
        future = pool.submit(Job("calm", 1, SCENARIO, str(tmp_path / "seed-1")))
        cluster.close()
        wait([future], LIMIT_S)
        assert future.cancelled()
        pool.stop()
    assert pool.gone == f"--dask {cluster.scheduler_address}: the scheduler has gone; the same command goes on"


def test_a_scheduler_that_hangs_is_told_of_the_end_once_and_not_waited_for(
    cluster: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C was not heard for as long as the scheduler hung."""
    told = list[str]()

    async def hang(name: str) -> None:
        told.append(name)
        await asyncio.Event().wait()

    with dask_pool.on_dask(cluster.scheduler_address) as pool:
        cluster.scheduler.handlers["event_set"] = hang
        monkeypatch.setattr(dask_pool, "ANSWER_S", 0.5)
        pool.stop()
    assert len(told) == 1


def test_a_worker_that_does_not_answer_at_the_start_is_told(cluster: Any) -> None:
    async def broadcast(**_: object) -> None:
        raise TimeoutError("timed out after 10 s")

    cluster.scheduler.handlers["broadcast"] = broadcast
    with pytest.raises(Trouble, match="its scheduler or a worker does not answer; end the one that hangs"):
        dask_pool.on_dask(cluster.scheduler_address).__enter__()


def test_a_campaign_whose_scheduler_has_gone_says_so_and_reports_what_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextlib.contextmanager
    def opened(_workers: int) -> Iterator[Pool]:
        def submit(job: Job) -> "Future[Result]":
            future = Future[Result]()
            if job.seed == 1:
                summary = {"scenario": "two", "seed": 1, "outcome": "success", "wall_clock": {"run_s": 3.0}}
                future.set_result(Result(job.arm, job.seed, summary))
            else:
                future.cancel()
            return future

        yield Pool(submit, lambda: None, 1, "far away", gone="the scheduler has gone")

    monkeypatch.setattr(pools, "here", opened)
    status, text = flown(tmp_path, "--runs", "3")
    assert status == 1
    assert text.count("sitl-emu: the scheduler has gone") == 1 and "1 of 3 runs are there" in text
    assert "the scheduler has gone" in (tmp_path / "c/report.html").read_text()
    assert json.loads((tmp_path / "c/results/two/seed-1.json").read_text())["summary"]["outcome"] == "success"


def test_a_worker_that_can_not_ask_whether_all_is_over_flies_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was told as a folder that can't be written, which ended the campaign."""

    class Unheard:
        def __init__(self, _name: str) -> None: ...

        def is_set(self) -> bool:
            raise OSError("ConnectionPool closing.")

    monkeypatch.setattr(distributed, "Event", Unheard)
    monkeypatch.setattr(
        dask_pool, "fly_where_it_can", lambda job, stopping: Result(job.arm, job.seed, stopped=stopping())
    )
    job = Job("calm", 1, SCENARIO, "nowhere")
    assert dask_pool._fly_on_worker(job, "over", __version__) == Result("calm", 1)


def test_a_cluster_without_workers_is_said_to_be_so_until_there_is_one(cluster: Any) -> None:
    address = cluster.scheduler_address
    with dask_pool.on_dask(address) as pool:
        assert pool.lacking() == f"--dask {address}: no workers there: start `dask worker {address} --nthreads 1`"
        cluster.scale(1)
        cluster.wait_for_workers(1, LIMIT_S)
        assert pool.lacking() == ""


def test_what_a_campaign_lacks_is_said_once_and_that_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    future = Future[Result]()
    lacks = ["no workers there", "no workers there", "", ""]

    def lacking() -> str:
        if len(lacks) == 1:
            summary = {"scenario": "two", "seed": 1, "outcome": "success", "wall_clock": {"run_s": 3.0}}
            future.set_result(Result("two", 1, summary))
        return lacks.pop(0)

    @contextlib.contextmanager
    def opened(_workers: int) -> Iterator[Pool]:
        yield Pool(lambda _job: future, lambda: None, 1, "far away", lacking)

    monkeypatch.setattr(pools, "here", opened)
    monkeypatch.setattr(campaigns, "LOOK_S", 0.01)
    status, text = flown(tmp_path, "--runs", "1")
    assert status == 0 and "far away no workers there it goes on 1/1 two, seed 1: success" in text


def test_a_worker_with_another_sitl_emu_that_joins_later_flies_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distributed, "get_worker", lambda: SimpleNamespace(address="tcp://10.0.0.7:4"))
    monkeypatch.setattr(dask_pool, "fly_where_it_can", lambda job, stopping: pytest.fail("flown"))
    assert dask_pool._fly_on_worker(Job("calm", 1, SCENARIO, "nowhere"), "over", "9.9.9").refused == (
        f"worker tcp://10.0.0.7:4 has sitl-emu {__version__}; the campaign's is 9.9.9: install it there, "
        "and the same command goes on"
    )


def test_workers_with_another_sitl_emu_are_refused_before_anything_is_flown(
    cluster: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    cluster.scale(1)
    cluster.wait_for_workers(1, LIMIT_S)
    monkeypatch.setattr(dask_pool, "_version", lambda: "9.9.9")
    with pytest.raises(Trouble, match=r"worker tcp://\S+ has sitl-emu 9.9.9; the campaign's is \S+: install it there"):
        dask_pool.on_dask(cluster.scheduler_address).__enter__()


def certificate(folder: Path, name: str) -> dict[str, str]:
    """Dask's configuration with a certificate that is its own authority; openssl makes it."""
    if shutil.which("openssl") is None:
        pytest.skip("no openssl, which makes certificates")
    key, made = str(folder / f"{name}.key"), str(folder / f"{name}.pem")
    curve = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2"]
    command = ["openssl", "req", "-x509", *curve, "-subj", f"/CN={name}", "-keyout", key, "-out", made]
    subprocess.run(command, check=True, capture_output=True)
    fields = {"ca-file": made}
    for role in ("client", "scheduler"):
        fields |= {f"{role}.cert": made, f"{role}.key": key}
    return {f"distributed.comm.tls.{field}": path for field, path in fields.items()}


def test_tls_goes_by_dasks_own_configuration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own, other = certificate(tmp_path, "own"), certificate(tmp_path, "other")
    with dask.config.set(own):
        security = distributed.Security()
    with distributed.LocalCluster(
        n_workers=0, processes=False, protocol="tls", host="127.0.0.1", dashboard_address=None, security=security
    ) as cluster:
        with dask.config.set(own), dask_pool.on_dask(cluster.scheduler_address) as pool:
            assert "no workers there" in pool.lacking(), "its scheduler has answered"
        with (
            dask.config.set(other),
            pytest.raises(Trouble, match=r"no scheduler answers there that the certificates of distributed\.comm\.tls"),
        ):
            monkeypatch.setattr(dask_pool, "ANSWER_S", 0.5)
            dask_pool.on_dask(cluster.scheduler_address).__enter__()


@pytest.mark.parametrize(
    ("configured", "wanted"),
    [
        ({}, "TLS needs distributed.comm.tls.ca-file and distributed.comm.tls.client.cert in Dask's configuration"),
        ({"ca-file": "/dev/null"}, "TLS needs distributed.comm.tls.client.cert in Dask's configuration"),
        (
            {"ca-file": "/nowhere/ca.pem", "client.cert": "/nowhere/own.pem"},
            "TLS can't read what distributed.comm.tls.ca-file, client.cert and client.key name: [Errno 2] No such file",
        ),
    ],
)
def test_tls_without_certificates_is_one_line_that_names_what_is_missing(
    tmp_path: Path, configured: dict[str, str], wanted: str
) -> None:
    with dask.config.set({f"distributed.comm.tls.{name}": value for name, value in configured.items()}):
        status, text = flown(tmp_path, "--runs", "1", "--dask", "tls://127.0.0.1:9")
    assert status == 2 and f"--dask tls://127.0.0.1:9: {wanted}" in text
