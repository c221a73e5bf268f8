"""`sitl-emu world` from outside: it serves the simulator API to an autopilot that connects, and ends with it."""

import signal
import subprocess
import sys
import time

import pytest

from sitl_emu.core import ports
from sitl_emu.core.simulator_api import ChannelClosed, HilActuatorControls, HilSensor
from sitl_emu.core.tcp_channel import TcpAutopilotChannel, connect
from tests.missions.runs import FIRST_INSTANCE

INSTANCE = FIRST_INSTANCE + 20


def connected(limit_s: float = 30.0) -> TcpAutopilotChannel:
    until = time.monotonic() + limit_s
    while True:
        try:
            return connect(ports.simulator(INSTANCE))
        except ChannelClosed:
            assert time.monotonic() < until
            time.sleep(0.1)


def test_an_autopilot_connects_gets_sensors_in_step_and_the_world_ends_with_it() -> None:
    command = [sys.executable, "-P", "-m", "sitl_emu", "world", "corn_field", "--vehicle", "iris", "--speed", "max"]
    command += ["--instance", str(INSTANCE)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        channel = connected()
        for tick in range(1, 51):
            sensor = channel.receive()[-1]
            assert isinstance(sensor, HilSensor) and sensor.time_usec == tick * 4000
            channel.send(HilActuatorControls(sensor.time_usec, 1, (0.0,) * 4, 0))
        channel.close()
        text, _ = process.communicate(timeout=30)
    assert process.returncode == 1
    assert f"iris: waiting for its autopilot on TCP {ports.simulator(INSTANCE)}" in text
    assert "the world ends" in text and "Traceback" not in text


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_while_it_waits(number: signal.Signals) -> None:
    command = [sys.executable, "-P", "-m", "sitl_emu", "world", "flat", "--vehicle", "rover:2"]
    command += ["--instance", str(INSTANCE)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        for place in range(2):
            assert f"TCP {ports.simulator(INSTANCE + place)}" in process.stdout.readline()
        process.send_signal(number)
        assert process.wait(30) == 0
        assert "Traceback" not in process.stdout.read()


def test_an_autopilot_that_speaks_late_gets_sensors_all_the_same() -> None:
    """As a real PX4, whose outputs start a while after its simulator."""
    command = [sys.executable, "-P", "-m", "sitl_emu", "world", "flat", "--vehicle", "iris", "--speed", "max"]
    command += ["--instance", str(INSTANCE)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        channel = connected()
        last = [channel.receive()[-1] for _ in range(10)][-1]
        assert isinstance(last, HilSensor) and last.time_usec == 40_000
        channel.send(HilActuatorControls(last.time_usec, 1, (0.0,) * 4, 0))
        assert channel.receive()
        channel.close()
        process.communicate(timeout=30)
