"""MAVSDK shell: what is typed is echoed and answered; long output comes whole."""

import contextlib
import queue
from collections.abc import Iterator
from typing import Any

import pytest
from mavsdk.plugins.shell import Device, Shell

from tests.interop.mavsdk_vehicle import STEP_LIMIT_S, Vehicle

PROMPT = "pxh> "
OPENING_TRIES, OPENING_LIMIT_S = 10, 2.0


class Console:
    """A shell and what it prints."""

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._printed: queue.Queue[str] = queue.Queue()
        self._handle = shell.subscribe_receive(lambda received, _user_data: self._hear(received))
        self._open()

    def _open(self) -> None:
        """MAVSDK asks for no answer until it has noticed the subscription, and such a message closes a shell."""
        for _ in range(OPENING_TRIES):
            self._shell.send("# open", Device.SHELL)
            with contextlib.suppress(queue.Empty):
                while not self._printed.get(timeout=OPENING_LIMIT_S).endswith(PROMPT):
                    pass
                return
        raise TimeoutError("the shell does not open")

    def _hear(self, received: Any) -> None:
        assert received.device == Device.SHELL
        self._printed.put(received.data)

    def output(self, line: str) -> str:
        """What a line prints, echo and prompt included; raises queue.Empty if the prompt does not come."""
        self._shell.send(line, Device.SHELL)
        printed = ""
        while not printed.endswith("\n" + PROMPT):
            printed += self._printed.get(timeout=STEP_LIMIT_S)
        return printed

    def close(self) -> None:
        """Hear no more."""
        self._shell.unsubscribe_receive(self._handle)


@pytest.fixture
def console(vehicle: Vehicle) -> Iterator[Console]:
    opened = Console(Shell(vehicle.system))
    yield opened
    opened.close()


def test_a_command_is_echoed_and_answered(console: Console) -> None:
    assert console.output("ver hw") == f"ver hw\nHW arch: PX4_SITL\n{PROMPT}"
    assert "Invalid command: nosuchcommand\n" in console.output("nosuchcommand")


def test_the_whole_parameter_list_comes_in_order(console: Console) -> None:
    lines = console.output("param show").splitlines()
    names = [line.split()[1 if line[2] == " " else 2] for line in lines if "] : " in line]
    assert len(names) > 900
    assert names == sorted(names)


def test_a_vehicle_is_armed_from_its_shell(console: Console, vehicle: Vehicle) -> None:
    vehicle.until_ready()
    assert "INFO  [commander] Disarmed\n" in console.output("commander status")
    # Simulated time is faster than the clock: it would disarm by itself before it has said that it is armed.
    with vehicle.with_param("COM_DISARM_PRFLT", -1.0):
        console.output("commander arm")
        assert "INFO  [commander] Armed\n" in console.output("commander status")
        console.output("commander disarm")
    assert "INFO  [commander] Disarmed\n" in console.output("commander status")
