"""`sitl-emu run` from outside: equal seeds, equal logs; whoever dies is named; nothing is left behind."""

import filecmp
import http.client
import json
import os
import re
import signal
import socket
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from pymavlink import mavutil
from pyulog import ULog

from sitl_emu.core import ports
from sitl_emu.run.score import WALL_CLOCK_KEYS
from tests.missions.runs import FIRST_INSTANCE, Run, short_scenario

LONG_S = 600.0
END_LIMIT_S = 5.0


def assert_its_processes_end(run: Run) -> None:
    until = time.monotonic() + END_LIMIT_S
    while run.children():
        assert time.monotonic() < until, f"still there: {run.children()}"
        time.sleep(0.05)


def assert_logs_are_readable(folder: Path) -> None:
    for line in (folder / "events.jsonl").read_text().splitlines():
        json.loads(line)
    for path in folder.glob("*-gcs.tlog"):
        log = mavutil.mavlink_connection(str(path))
        types = set[str]()
        while (message := log.recv_match()) is not None:
            types.add(message.get_type())
        log.close()
        assert types and "BAD_DATA" not in types


def assert_nothing_is_left(run: Run) -> None:
    assert not run.children()
    assert not [path.name for path in Path("/dev/shm").iterdir() if str(run.process.pid) in path.name]
    for instance in (FIRST_INSTANCE, FIRST_INSTANCE + 1):
        for port in (ports.gcs(instance).local, ports.onboard(instance).local):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
                tried.bind(("0.0.0.0", port))
        with socket.socket() as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind(("127.0.0.1", ports.simulator(instance)))


def shared_field(pid: int) -> str:
    """The inode of the memory that cameras share, where a process holds it; it has no name, and goes with the last."""
    maps = [line.split() for line in Path(f"/proc/{pid}/maps").read_text().splitlines() if "/memfd:sitl_emu-c" in line]
    return maps[0][4] if maps else ""


def look_on(run: Run) -> tuple[list[dict[str, Any]], int]:
    """What the page of a run is told until the run is over, and the page's port."""
    run.wait_until(lambda: "page: " in run.text)
    port = int(run.text.split("page: http://127.0.0.1:")[1].split("/")[0])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=100)
    connection.request("GET", "/stream")
    told = [json.loads(line) for line in re.findall(rb"^data: (.+)$", connection.getresponse().read(), re.MULTILINE)]
    connection.close()
    return told, port


def test_the_same_seed_at_two_speeds_and_looked_at_gives_identical_logs_and_summaries(tmp_path: Path) -> None:
    scenario = short_scenario(tmp_path, 6.0)
    with Run(scenario, tmp_path / "fast", "--speed", "max", "--seed", "5") as run:
        assert run.wait(100) == 1, run.text
    with Run(scenario, tmp_path / "slow", "--speed", "1.5", "--seed", "5", "--view") as run:
        told, port = look_on(run)
        assert run.wait(100) == 1, run.text
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port))
    assert sum("track" in rows for rows in told) > 3, "as it goes on"
    assert [rows["over"]["outcome"] for rows in told if "over" in rows] == ["time limit reached"]
    fast, slow = tmp_path / "fast", tmp_path / "slow"
    logs = sorted(path.name for path in fast.glob("*.tlog"))
    assert {"uas-gcs.tlog", "uas-onboard.tlog", "uas-peer.tlog", "ugv-peer.tlog"} <= set(logs)
    assert all((fast / name).stat().st_size > 1000 for name in logs)
    assert {dataset.name for dataset in ULog(str(fast / "uas.ulg")).data_list} > {"vehicle_attitude", "actuator_motors"}
    logs += ["uas.ulg", "ugv.ulg", "uas-detections.jsonl", "truth-uas.csv"]
    frames = [str(path.relative_to(fast)) for path in fast.glob("feeds/*/*.jpg")]
    assert len(frames) == 2 * 6, "one a second of each camera"
    logs += frames
    different = [name for name in [*logs, "events.jsonl"] if not filecmp.cmp(fast / name, slow / name, shallow=False)]
    assert not different
    one, other = (json.loads((folder / "summary.json").read_text()) for folder in (fast, slow))
    assert one["outcome"] == "time limit reached" and one["frames_dropped"] == 0
    assert len(frames) < one["frames_rendered"] < 90, "the UGV's are those that are kept: it looks at targets alone"
    for key in WALL_CLOCK_KEYS:
        one.pop(key), other.pop(key)
    assert one == other


@pytest.mark.parametrize(
    ("victim", "named"),
    [
        ("autopilot_process ugv", "autopilot ugv"),
        ("companion_process uas", "companion uas"),
        ("camera_process uas", "camera uas"),
        ("world_process", "world"),
    ],
)
def test_a_process_that_is_killed_is_named_and_the_rest_ends(tmp_path: Path, victim: str, named: str) -> None:
    with Run(short_scenario(tmp_path, LONG_S), tmp_path / "run", "--speed", "max") as run:
        run.wait_until_flying()
        children = run.children()
        assert len(children) == 7
        os.kill(children[victim], signal.SIGKILL)
        assert_its_processes_end(run)
        assert run.wait(60) == 1
        assert f"{named} (pid {children[victim]}) was killed by SIGKILL" in run.text
        assert json.loads((run.out / "summary.json").read_text())["outcome"].startswith(named)
        assert (run.out / "report.html").is_file() and (run.out / "uas-gcs.tlog").stat().st_size > 0
        assert_logs_are_readable(run.out)
        assert_nothing_is_left(run)


def test_cameras_share_their_field_and_a_launcher_that_is_killed_leaves_nothing_of_it(tmp_path: Path) -> None:
    with Run(short_scenario(tmp_path, LONG_S), tmp_path / "run", "--speed", "max") as run:
        run.wait_until_flying()
        children = run.children()
        assert {title for title, pid in children.items() if shared_field(pid)} == {
            "camera_process uas",
            "camera_process ugv",
        }
        assert len({shared_field(children[f"camera_process {name}"]) for name in ("uas", "ugv")}) == 1
        assert not shared_field(run.process.pid)
        os.kill(run.process.pid, signal.SIGKILL)
        run.wait(60)
        assert_its_processes_end(run)
        assert_nothing_is_left(run)


def test_a_process_killed_while_the_run_starts_is_named_too(tmp_path: Path) -> None:
    with Run(short_scenario(tmp_path, LONG_S), tmp_path / "run") as run:
        until = time.monotonic() + 30.0
        while "camera_process ugv" not in (children := run.children()):
            assert time.monotonic() < until and run.process.poll() is None, run.text
            time.sleep(0.01)
        os.kill(children["camera_process ugv"], signal.SIGKILL)
        assert_its_processes_end(run)
        assert run.wait(60) == 1
        assert f"camera ugv (pid {children['camera_process ugv']}) was killed by SIGKILL" in run.text
        assert_nothing_is_left(run)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_run_and_leaves_nothing(tmp_path: Path, number: signal.Signals) -> None:
    with Run(short_scenario(tmp_path, LONG_S), tmp_path / "run", "--speed", "1") as run:
        run.wait_until_flying()
        run.process.send_signal(number)
        assert_its_processes_end(run)
        assert run.wait(60) == 1
        summary = json.loads((run.out / "summary.json").read_text())
        assert summary["outcome"] == "interrupted" and summary["frames_rendered"] > 0
        assert_nothing_is_left(run)


def test_a_signal_while_it_starts_leaves_nothing_either(tmp_path: Path) -> None:
    with Run(short_scenario(tmp_path, LONG_S), tmp_path / "run") as run:
        until = time.monotonic() + 30.0
        while len(run.children()) < 3 and time.monotonic() < until:
            time.sleep(0.02)
        run.process.send_signal(signal.SIGINT)
        assert_its_processes_end(run)
        assert run.wait(60) == 1
        assert_nothing_is_left(run)


def test_a_port_in_use_is_named_before_anything_starts(tmp_path: Path) -> None:
    port = ports.onboard(FIRST_INSTANCE + 1).local
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("0.0.0.0", port))
        with Run(short_scenario(tmp_path, LONG_S), tmp_path / "run") as run:
            assert run.wait(60) == 2
    assert f"UDP port {port}" in run.text and "vehicle ugv" in run.text and "--instance" in run.text


def test_any_command_may_be_a_companion_and_ends_the_run_when_it_ends(tmp_path: Path) -> None:
    talk = "import sys, time; print(sys.argv[1:]); time.sleep(1); sys.exit(3)"
    uas: dict[str, Any] = {"name": "uas", "model": "iris", "start": "home"}
    uas["companion"] = {"command": ["python3", "-c", talk, "{connect}", "{out}"]}
    scenario = {"name": "own", "world": {"kind": "flat"}, "vehicles": [uas], "time_limit_s": LONG_S}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(scenario))
    with Run(tmp_path / "own.yaml", tmp_path / "run", "--speed", "5") as run:
        assert run.wait(60) == 1
    assert "outcome: companion uas: exit status 3" in run.text
    assert f"its log {tmp_path / 'run/logs/companion-uas.log'} ends:" in run.text
    said = (tmp_path / "run/logs/companion-uas.log").read_text()
    assert f"udpin:127.0.0.1:{ports.onboard(FIRST_INSTANCE).remote}" in said and str(tmp_path / "run") in said


def test_a_command_in_the_background_does_not_keep_a_run_from_its_end(tmp_path: Path) -> None:
    uas = {"name": "uas", "model": "iris", "companion": {"command": ["sleep", "0.5"]}}
    ugv = {"name": "ugv", "model": "rover", "start": {"north_m": 5.0, "east_m": 5.0}}
    ugv["companion"] = {"command": ["sleep", "1000"], "background": True}
    scenario = {"name": "own", "world": {"kind": "flat"}, "vehicles": [uas, ugv], "time_limit_s": LONG_S}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(scenario))
    with Run(tmp_path / "own.yaml", tmp_path / "run", "--speed", "5") as run:
        assert run.wait(60) == 0, run.text
        assert_nothing_is_left(run)


def test_a_companion_command_that_is_not_there_is_named(tmp_path: Path) -> None:
    uas = {"name": "uas", "model": "iris", "companion": {"command": ["./no-such-program"]}}
    scenario = {"name": "own", "world": {"kind": "flat"}, "vehicles": [uas], "time_limit_s": LONG_S}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(scenario))
    with Run(tmp_path / "own.yaml", tmp_path / "run") as run:
        assert run.wait(60) == 2
        assert "companion uas: can't start './no-such-program'" in run.text
        assert_nothing_is_left(run)
