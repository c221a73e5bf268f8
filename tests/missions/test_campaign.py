"""Campaigns as a user starts them: runs that keep to themselves, resumed, stopped, and on a Dask cluster."""

import contextlib
import csv
import filecmp
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from sitl_emu.core import ports

LIMIT_S = 330.0
SCENARIO = {
    "name": "toss",
    "world": "flat",
    "time_limit_s": 1500,
    "vehicles": [{"name": "coin", "model": "iris", "companion": {"mission": "toss", "options": {"wait_s": 0.1}}}],
}


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder with the mission of toss.py, found as an installed package's, and its scenario."""
    shutil.copy(Path(__file__).with_name("toss.py"), tmp_path)
    packed = tmp_path / "toss-1.dist-info"
    packed.mkdir()
    (packed / "METADATA").write_text("Metadata-Version: 2.1\nName: toss\nVersion: 1\n")
    (packed / "entry_points.txt").write_text("[sitl_emu.missions]\ntoss = toss:MISSION\n")
    (tmp_path / "toss.yaml").write_text(yaml.safe_dump(SCENARIO))
    return tmp_path


class Campaign:
    """A campaign under way."""

    def __init__(self, site: Path, *words: str) -> None:
        self.log = site / "campaign.txt"
        self._written = self.log.open("ab")
        self._from = self._written.tell()
        self.process = start(site, ["-m", "sitl_emu", "campaign", "toss.yaml", *words], self._written.fileno())

    def __enter__(self) -> "Campaign":
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._written.close()

    @property
    def text(self) -> str:
        return self.log.read_bytes()[self._from :].decode()

    def wait(self) -> int:
        return self.process.wait(LIMIT_S)

    def wait_for(self, text: str) -> None:
        until = time.monotonic() + LIMIT_S
        while text not in self.text:
            assert time.monotonic() < until and self.process.poll() is None, self.text
            time.sleep(0.05)


def start(site: Path, words: list[str], output: int = subprocess.DEVNULL) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        [sys.executable, "-P", *words],
        cwd=site,
        env={**os.environ, "PYTHONPATH": str(site)},
        stdout=output,
        stderr=subprocess.STDOUT if output != subprocess.DEVNULL else subprocess.DEVNULL,
    )


@contextlib.contextmanager
def px4s_ports_in_use() -> Iterator[None]:
    with contextlib.ExitStack() as held:
        for port in (ports.gcs(0).local, ports.onboard(0).local, ports.onboard(0).remote, ports.GCS_REMOTE):
            opened = held.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            with contextlib.suppress(OSError):  # another test's, then
                opened.bind(("127.0.0.1", port))
        yield


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "runs.csv").open() as file:
        return list(csv.DictReader(file))


def under_way(site: Path) -> list[int]:
    """Processes that are at work below a folder."""
    found = list[int]()
    for folder in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if folder.name.isdigit() and f"{site}/" in (folder / "cmdline").read_bytes().decode(errors="replace"):
                found.append(int(folder.name))
    return found


def wait_until_nothing_is_under_way(site: Path) -> None:
    until = time.monotonic() + LIMIT_S / 2
    while under_way(site):
        assert time.monotonic() < until
        time.sleep(0.1)


def test_runs_side_by_side_keep_to_themselves_and_the_same_command_goes_on(site: Path) -> None:
    """Both arms fly the same: their logs are equal to the byte, though they fly at once, and PX4's ports are taken."""
    words = ("--vary", "time_limit_s=1400,1500", "--workers", "2", "--out", "c")
    with px4s_ports_in_use(), Campaign(site, "--runs", "1", *words) as first:
        assert first.wait() == 0, first.text
    assert "2 runs in 2 arms, 0 there" in first.text and "2 of 2 runs are there" in first.text
    one, other = (site / f"c/runs/time_limit_s={limit}/seed-1" for limit in (1400, 1500))
    logs = sorted(path.name for path in one.glob("*.tlog"))
    assert "coin-onboard.tlog" in logs and "coin-gcs.tlog" in logs
    assert (one / "coin-onboard.tlog").stat().st_size > 1000
    for name in [*logs, "events.jsonl", "coin.ulg", "truth-coin.csv"]:
        assert filecmp.cmp(one / name, other / name, shallow=False), name
    kept = (site / "c/results/time_limit_s=1400/seed-1.json").stat().st_mtime_ns
    with Campaign(site, "--runs", "1", *words) as again:
        assert again.wait() == 0, again.text
    assert "2 runs in 2 arms, 2 there" in again.text
    assert (site / "c/results/time_limit_s=1400/seed-1.json").stat().st_mtime_ns == kept, "none is flown twice"
    assert [(row["arm"], row["seed"], row["number"]) for row in rows(site / "c")] == [
        ("time_limit_s=1400", "1", "0.134364"),
        ("time_limit_s=1500", "1", "0.134364"),
    ]
    assert {"tosses.csv", "runs.parquet", "report.html"} <= {path.name for path in (site / "c").iterdir()}


def test_ctrl_c_keeps_what_is_there_and_leaves_nothing_under_way(site: Path) -> None:
    words = ("--runs", "2", "--vary", "vehicles.coin.companion.options.wait_s=0.1,900", "--workers", "1", "--out", "c")
    with Campaign(site, *words) as stopped:
        stopped.wait_for("1/4  wait_s=0.1, seed 1: lost the toss")
        stopped.process.send_signal(signal.SIGINT)
        assert stopped.wait() == 130, stopped.text
    assert "stopped; the same command goes on" in stopped.text and "1 of 4 runs are there" in stopped.text
    wait_until_nothing_is_under_way(site)
    assert [row["arm"] for row in rows(site / "c")] == ["wait_s=0.1"]
    assert [path.name for path in (site / "c/runs").rglob("seed-*")] == ["seed-1"]
    assert list((site / "c/runs").rglob(".seed-*")) == []


def test_on_a_dask_cluster_a_worker_that_is_killed_loses_nothing_and_counts_nothing_twice(site: Path) -> None:
    """Two workers without nannies: what the killed one flew ends with it, and is flown by the other."""
    named = site / "scheduler.json"
    scheduler = start(
        site, ["-m", "distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(named)]
    )
    command = ["-m", "distributed.cli.dask_worker", "--scheduler-file", str(named), "--nthreads", "1", "--no-nanny"]
    workers = [start(site, [*command, "--no-dashboard"]) for _ in range(2)]
    try:
        until = time.monotonic() + LIMIT_S / 2
        while not named.is_file() or not named.read_text():
            assert time.monotonic() < until and scheduler.poll() is None
            time.sleep(0.1)
        address = json.loads(named.read_text())["address"]
        with Campaign(site, "--runs", "4", "--dask", address, "--out", "c") as campaign:
            campaign.wait_for("1/4")
            workers[0].kill()
            assert campaign.wait() == 0, campaign.text
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()
    assert "4 of 4 runs are there" in campaign.text
    assert [row["seed"] for row in rows(site / "c")] == ["1", "2", "3", "4"]
    assert {row["number"] for row in rows(site / "c")} >= {"0.134364", "0.956034"}
    wait_until_nothing_is_under_way(site / "c")
    assert sorted(path.name for path in (site / "c/runs/toss").glob("seed-*")) == [f"seed-{n}" for n in (1, 2, 3, 4)]
