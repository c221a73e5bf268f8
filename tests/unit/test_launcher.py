"""The launcher of a run: signals at any stage, and processes that end when they should not."""

import errno
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sitl_emu.run import launcher, wiring
from sitl_emu.run.children import Child, end_all, start_command
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.live_view import View
from sitl_emu.run.messages import EventTold, Message, Over, Progress
from sitl_emu.run.scenario import find, load
from sitl_emu.run.trouble import Trouble

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


class NoView(View):
    def status(self, status: Progress) -> None:
        pass

    def event(self, event: EventTold) -> None:
        pass

    def close(self) -> None:
        pass


def child(folder: Path, title: str, program: str, *, command: bool = False, waits: bool = False) -> Child:
    (folder / "log").touch()
    stdin = subprocess.PIPE if waits else subprocess.DEVNULL
    process = subprocess.Popen([sys.executable, "-c", program], stdin=stdin, start_new_session=True)
    return Child(title, process, folder / "log", command)


def release(waiting: Child) -> None:
    waiting.process.communicate(b"\n")


Start = Callable[[wiring.Wanted, list[Child]], ControlChannel]


class AWorld:
    """The launcher's channel to a world process, and what that says."""

    def __init__(self) -> None:
        ours, self._its = socket.socketpair()
        self.control, self._end = ControlChannel(ours, "the world process"), ControlChannel(self._its, "the launcher")

    def say(self, message: Message) -> None:
        self._end.send(message)

    def die(self) -> None:
        self._its.close()

    def close(self) -> None:
        self.control.close()
        self._its.close()


@pytest.fixture
def world() -> Iterator[AWorld]:
    made = AWorld()
    yield made
    made.close()


def run(folder: Path, monkeypatch: pytest.MonkeyPatch, start: Start) -> launcher.Ending:
    monkeypatch.setattr(wiring, "start", start)
    folder = folder / "run"
    folder.mkdir()
    return launcher.run(wiring.Wanted(load(find("agriculture")), 1, None, folder), NoView())


@pytest.mark.usefixtures("hears_hang_up")
@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_while_a_process_is_started_ends_that_too(
    tmp_path: Path, world: AWorld, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    there = list[Child]()

    def start(_: wiring.Wanted, children: list[Child]) -> ControlChannel:
        there.append(child(tmp_path, "companion uas", "import time; time.sleep(1000)", command=True))
        os.kill(os.getpid(), number)
        children += there
        world.die()
        return world.control

    assert run(tmp_path, monkeypatch, start).outcome == "interrupted"
    assert there[0].process.poll() is not None


@pytest.mark.usefixtures("hears_hang_up")
@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_while_processes_are_ended_leaves_none_and_the_runs_outcome(
    tmp_path: Path, world: AWorld, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    there = list[Child]()

    def start(_: wiring.Wanted, children: list[Child]) -> ControlChannel:
        there.append(child(tmp_path, "companion uas", "import time; time.sleep(1000)", command=True))
        children += there
        world.say(Over("success"))
        return world.control

    def end(children: list[Child], patience_s: float) -> None:
        os.kill(os.getpid(), number)
        end_all(children, patience_s)

    monkeypatch.setattr(launcher, "end_all", end)
    assert run(tmp_path, monkeypatch, start).outcome == "success"
    assert there[0].process.poll() is not None


def test_a_hang_up_that_is_ignored_as_by_nohup_stays_so(
    tmp_path: Path, world: AWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start(_: wiring.Wanted, children: list[Child]) -> ControlChannel:
        os.kill(os.getpid(), signal.SIGHUP)
        world.say(Over("success"))
        return world.control

    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert run(tmp_path, monkeypatch, start).outcome == "success"
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_companion_that_ends_when_the_world_has_gone_is_no_error_of_the_launchers(
    tmp_path: Path, world: AWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start(_: wiring.Wanted, children: list[Child]) -> ControlChannel:
        children.append(child(tmp_path, "world", "raise SystemExit(7)"))
        children.append(child(tmp_path, "companion uas", "", command=True))
        for each in children:
            each.process.wait()
        monkeypatch.setattr(world.control, "poll", lambda: None)  # its end has not come yet
        world.die()
        return world.control

    assert "exit status 7" in run(tmp_path, monkeypatch, start).outcome


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "run/logs/world.log"), "can't write there: No space left"),
        (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "can't be started: Resource temporarily"),
    ],
)
def test_processes_that_can_not_be_started_are_told_in_a_line_and_those_that_were_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError, told: str
) -> None:
    there = list[Child]()

    def start(_: wiring.Wanted, children: list[Child]) -> ControlChannel:
        there.append(child(tmp_path, "world", "import time; time.sleep(1000)"))
        children += there
        raise error

    with pytest.raises(Trouble, match=told):
        run(tmp_path, monkeypatch, start)
    assert there[0].process.poll() is not None


def test_who_has_died_is_named_though_a_companion_has_failed_long_before(
    tmp_path: Path, world: AWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start(_: wiring.Wanted, children: list[Child]) -> ControlChannel:
        children.append(child(tmp_path, "companion uas", "raise SystemExit(1)", command=True))
        children[0].process.wait()
        children.append(child(tmp_path, "autopilot uas", "input(); raise SystemExit(5)", waits=True))
        world.say(Over("", lost="the autopilot has gone"))
        monkeypatch.setattr("time.sleep", lambda _: release(children[1]))  # it dies while it is looked who has
        return world.control

    ending = run(tmp_path, monkeypatch, start)
    assert ending.outcome.startswith("autopilot uas (pid") and "exit status 5" in ending.outcome and not ending.accident


def test_what_a_companion_has_started_and_left_ends_with_the_run(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    left = start_command("companion uas", ["sh", "-c", "sleep 1000 & echo $!"], {}, tmp_path)
    left.process.wait()
    pid = int(left.log.read_text())
    assert (Path("/proc") / str(pid)).is_dir()
    end_all([left], 1.0)
    state = Path("/proc") / str(pid) / "stat"  # "Z": dead, and nobody here waits for it
    assert not state.exists() or state.read_text().rpartition(")")[2].split()[0] == "Z"
