"""`sitl-emu world` from outside: it serves the simulator API to an autopilot that connects, and ends with it."""

import contextlib
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.core.simulator_api import ChannelClosed, HilActuatorControls, HilSensor
from sitl_emu.core.tcp_channel import TcpAutopilotChannel, connect
from sitl_emu.run.autopilot_command import AirframeError, read_airframe
from tests.launched import ignore_ctrl_c
from tests.missions.runs import FIRST_INSTANCE

INSTANCE = FIRST_INSTANCE + 40


def connected(instance: int = INSTANCE, limit_s: float = 30.0) -> TcpAutopilotChannel:
    until = time.monotonic() + limit_s
    while True:
        try:
            return connect(ports.simulator(instance))
        except ChannelClosed:
            assert time.monotonic() < until
            time.sleep(0.1)


@contextmanager
def started(command: list[str], *, in_background: bool = False) -> Iterator[subprocess.Popen[str]]:
    """A process that is gone afterwards, whatever came out; `in_background`: as a script's `&` starts it."""
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        preexec_fn=ignore_ctrl_c if in_background else None,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def test_an_autopilot_connects_gets_sensors_in_step_and_the_world_ends_with_it() -> None:
    command = [sys.executable, "-P", "-m", "sitl_emu", "world", "corn_field", "--vehicle", "iris", "--speed", "max"]
    command += ["--instance", str(INSTANCE)]
    with started(command) as process:
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
    with started(command, in_background=True) as process:
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
    with started(command) as process:
        channel = connected()
        last = [channel.receive()[-1] for _ in range(10)][-1]
        assert isinstance(last, HilSensor) and last.time_usec == 40_000
        channel.send(HilActuatorControls(last.time_usec, 1, (0.0,) * 4, 0))
        assert channel.receive()
        channel.close()
        process.communicate(timeout=30)


def test_our_autopilot_alone_flies_in_it_and_a_ground_station_arms_it() -> None:
    instance = INSTANCE + 4
    autopilot = [sys.executable, "-P", "-m", "sitl_emu.autopilot", "--airframe", "vehicles/iris/airframe.json"]
    world = [sys.executable, "-P", "-m", "sitl_emu", "world", "corn_field", "--vehicle", "iris", "--speed", "4"]
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen([*autopilot, "--instance", str(instance)], **both) as pilot:  # type: ignore[call-overload]
        waits = pilot.stdout.readline()
        simulator = subprocess.Popen([*world, "--instance", str(instance)], **both)  # type: ignore[call-overload]
        station = mavutil.mavlink_connection(f"udpout:127.0.0.1:{ports.gcs(instance).local}", source_system=255)
        until, result = time.monotonic() + 60.0, None
        try:
            while result != 0:
                assert time.monotonic() < until and pilot.poll() is None and simulator.poll() is None
                station.mav.heartbeat_send(6, 8, 0, 0, 4)
                station.mav.command_long_send(ports.system_id(instance), 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
                ack = station.recv_match(type="COMMAND_ACK", blocking=True, timeout=0.5)
                result = None if ack is None else ack.result
        finally:
            station.close()
            pilot.terminate()
            simulator_said, pilot_said = simulator.communicate(timeout=30)[0], pilot.communicate(timeout=30)[0]
            simulator.terminate()
    assert (pilot.returncode, simulator.returncode) == (0, 1)
    assert f"no simulator answers on 127.0.0.1, TCP port {ports.simulator(instance)}" in waits
    assert "the world ends" in simulator_said and "Traceback" not in simulator_said + pilot_said


def test_our_autopilot_reboots_and_shuts_down_and_the_world_ends_with_it() -> None:
    instance = INSTANCE + 5
    autopilot = [sys.executable, "-P", "-m", "sitl_emu.autopilot", "--model", "iris", "--instance", str(instance)]
    world = [sys.executable, "-P", "-m", "sitl_emu", "world", "flat", "--vehicle", "iris", "--speed", "4"]
    with (
        started([*world, "--instance", str(instance)]) as simulator,
        started(autopilot) as pilot,
        contextlib.closing(
            mavutil.mavlink_connection(f"udpout:127.0.0.1:{ports.gcs(instance).local}", source_system=255)
        ) as station,
    ):

        def wait(kind: str, accept: Callable[[Any], bool]) -> Any:
            until = time.monotonic() + 60.0
            while time.monotonic() < until:
                station.mav.heartbeat_send(6, 8, 0, 0, 4)
                message = station.recv_match(type=kind, blocking=True, timeout=0.5)
                if message is not None and accept(message):
                    return message
            raise TimeoutError(kind)

        def power(what: int) -> None:
            station.mav.command_long_send(ports.system_id(instance), 1, 246, 0, what, 0, 0, 0, 0, 0, 0)
            assert wait("COMMAND_ACK", lambda ack: ack.command == 246).result == 0

        wait("HEARTBEAT", lambda heartbeat: heartbeat.get_srcComponent() == mavlink.MAV_COMP_ID_CAMERA)
        wait("ATTITUDE", lambda attitude: attitude.time_boot_ms > 5000)
        power(1)
        wait("ATTITUDE", lambda attitude: attitude.time_boot_ms < 5000)
        wait("HEARTBEAT", lambda heartbeat: heartbeat.system_status == 3 and heartbeat.get_srcComponent() == 1)
        power(2)
        simulator_said, pilot_said = simulator.communicate(timeout=30)[0], pilot.communicate(timeout=30)[0]
    assert (pilot.returncode, simulator.returncode) == (0, 0)
    assert "the autopilot was rebooted\nthe autopilot was shut down" in pilot_said
    assert "iris: its autopilot was rebooted\niris: its autopilot was shut down" in simulator_said


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (None, "No such file or directory"),
        ("{", "not JSON"),
        ("[]", "allowed: a JSON object of PX4 parameters"),
        ('{"MPC_XY_P": "high"}', "MPC_XY_P: 'high'; allowed: a number"),
        ('{"MPC_XY_PP": 1}', "MPC_XY_PP: PX4 has no such parameter"),
    ],
)
def test_a_wrong_airframe_is_told(tmp_path: Path, text: str | None, wanted: str) -> None:
    file = tmp_path / "airframe.json"
    if text is not None:
        file.write_text(text)
    with pytest.raises(AirframeError, match=re.escape(wanted)) as told:
        read_airframe(file)
    assert str(file) in str(told.value)
