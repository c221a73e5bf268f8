"""The channel to an autopilot from outside that comes late to its first ticks, as a process does on a busy machine."""

import contextlib
import socket
from collections.abc import Iterator

import pytest

from sitl_emu import vehicles
from sitl_emu.core.simulator_api import LOCKSTEP, HilActuatorControls, HilSensor
from sitl_emu.core.tcp_channel import TcpAutopilotChannel, TcpSimulatorChannel, connect
from sitl_emu.run.outside_channel import OutsideChannel

TICK_US = 4000
SLEPT = 5
"""Ticks that came before the autopilot had a look."""


@contextlib.contextmanager
def ends() -> Iterator[tuple[OutsideChannel, TcpAutopilotChannel]]:
    """Of a multicopter's channel; an answer that never comes is an error."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        autopilot = connect(listener.getsockname()[1])
        connection, _ = listener.accept()
    simulator = TcpSimulatorChannel(connection, 4560)
    simulator.limit_answers(10.0)
    try:
        yield OutsideChannel(simulator, vehicles.load("iris")), autopilot
    finally:
        simulator.close()
        autopilot.close()


def tick(number: int) -> HilSensor:
    return HilSensor(number * TICK_US, *(0.0,) * 13, 0, 0)


def answer(autopilot: TcpAutopilotChannel, flags: int, time_usec: int | None = None) -> None:
    """Take a tick and answer it, by its time unless told another."""
    sensor = autopilot.receive()[-1]
    assert isinstance(sensor, HilSensor)
    autopilot.send(HilActuatorControls(sensor.time_usec if time_usec is None else time_usec, flags, (0.0,) * 16, 0))


def test_who_slept_through_its_first_ticks_is_not_behind_for_ever() -> None:
    with ends() as (simulator, autopilot):
        for number in range(1, SLEPT + 1):
            simulator.send([tick(number)])
            assert simulator.receive().time_usec == 0, "nothing was said yet"
        answer(autopilot, LOCKSTEP)
        simulator.send([tick(SLEPT + 1)])
        assert simulator.receive().time_usec == TICK_US, "it speaks"
        for _ in range(SLEPT):
            answer(autopilot, LOCKSTEP)
        for number in range(SLEPT + 2, SLEPT + 5):
            simulator.send([tick(number)])
            answer(autopilot, LOCKSTEP)
            assert simulator.receive().time_usec == number * TICK_US


def test_who_has_made_nothing_new_is_not_waited_for() -> None:
    """Its outputs are older than the tick: there is no later answer."""
    with ends() as (simulator, autopilot):
        for number in range(1, 4):
            simulator.send([tick(number)])
            answer(autopilot, LOCKSTEP, TICK_US)
            assert simulator.receive().time_usec == TICK_US


@pytest.mark.parametrize("flags", [0, LOCKSTEP])
def test_every_answer_of_who_keeps_up_counts(flags: int) -> None:
    """Also that of one whose time is another than the simulator's, which then says nothing of lockstep."""
    with ends() as (simulator, autopilot):
        for number in range(1, 4):
            simulator.send([tick(number)])
            time_usec = number * TICK_US if flags else number
            answer(autopilot, flags, time_usec)
            assert simulator.receive().time_usec == time_usec
