"""A launch that is told to end before all its vehicles have begun."""

import os
import signal
import threading
from collections.abc import Iterator, Sequence
from types import FrameType

import pytest

from sitl_emu.run import launch
from sitl_emu.run.launched import Crew


@pytest.fixture
def told() -> Iterator[list[int]]:
    """The signals that were handled; those that were blocked are free again afterwards."""
    handled = list[int]()

    def handle(number: int, _frame: FrameType | None) -> None:
        handled.append(number)

    before = signal.signal(signal.SIGINT, handle)
    yield handled
    signal.pthread_sigmask(signal.SIG_UNBLOCK, launch.ENDING)
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_while_vehicles_are_forked_waits_for_who_can_end_them(
    monkeypatch: pytest.MonkeyPatch, told: list[int]
) -> None:
    forked = list[int]()

    def fork_and_ctrl_c() -> int:
        signal.pthread_kill(threading.get_ident(), signal.SIGINT)  # a launcher has one thread, and pytest may have more
        forked.append(1000 + len(forked))
        return forked[-1]

    monkeypatch.setattr(os, "fork", fork_and_ctrl_c)
    monkeypatch.setattr(launch, "_preload", lambda models: None)
    crews = _crews(3)
    children = launch._fork(crews, 0, print)
    assert list(children) == forked == [1000] and not told
    signal.pthread_sigmask(signal.SIG_UNBLOCK, launch.ENDING)
    assert told == [signal.SIGINT]


def test_how_many_have_begun_is_told_while_one_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launch, "TELL_EVERY_S", 0.0)
    begun, began = os.pipe()
    said = list[str]()

    def say(line: str) -> None:
        said.append(line)
        if len(said) == 1:
            os.write(began, b"\0\0")
        elif line.startswith("2"):
            os.close(began)

    assert not launch._all_begin(begun, 3, say)
    assert said[0] == "0 of 3 processes have begun" and said[-1] == "2 of 3 processes have begun"


def _crews(count: int) -> Sequence[Crew]:
    return [Crew([], None, False, 1.0, None, None) for _ in range(count)]  # type: ignore[arg-type]
