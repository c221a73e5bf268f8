"""What goes wrong around `sitl-emu launch`: it is said, and nothing is left behind."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from pymavlink import mavutil

from tests.launched import launched

INSTANCE = 110
GONE_LIMIT_S = 30.0


def gcs_port(place: int) -> int:
    return 18570 + INSTANCE + place


def is_free(port: int) -> bool:
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        try:
            probe.bind(("0.0.0.0", port))
        except OSError:
            return False
        return True


def wait_until_free(*ports: int) -> None:
    end = time.monotonic() + GONE_LIMIT_S
    while not all(is_free(port) for port in ports):
        assert time.monotonic() < end, f"still in use: {[port for port in ports if not is_free(port)]}"
        time.sleep(0.05)


def children_of(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def wait_for(link: Any, kind: str, accept: Callable[[Any], bool]) -> Any:
    """The next accepted message of a kind, speaking as a ground station meanwhile."""
    end = time.monotonic() + 30.0
    while time.monotonic() < end:
        link.mav.heartbeat_send(6, 8, 0, 0, 4)
        message = link.recv_match(type=kind, blocking=True, timeout=0.5)
        if message is not None and accept(message):
            return message
    raise TimeoutError(f"no {kind} as awaited")


@contextlib.contextmanager
def linked(place: int) -> Iterator[Any]:
    """A ground station of one vehicle."""
    with contextlib.closing(
        mavutil.mavlink_connection(f"udpout:127.0.0.1:{gcs_port(place)}", source_system=255)
    ) as link:
        yield link


@contextlib.contextmanager
def two_that_speak(*, in_background: bool = False) -> Iterator[subprocess.Popen[str]]:
    """Two vehicles whose heartbeats have been heard; `in_background`: as a script's `&` starts them."""
    with launched("iris:2", "--instance", str(INSTANCE), in_background=in_background) as process:
        for place in range(2):
            with linked(place) as link:
                wait_for(link, "HEARTBEAT", lambda _heartbeat: True)
        yield process


def command_power(link: Any, what: int, place: int = 0) -> None:
    """MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: 1 reboots the autopilot, 2 shuts it down."""
    while link.recv_match() is not None:
        pass  # a socket that was not read for long has no room for the answer
    link.mav.command_long_send(INSTANCE + place + 1, 1, 246, 0, what, 0, 0, 0, 0, 0, 0)
    assert wait_for(link, "COMMAND_ACK", lambda ack: ack.command == 246).result == 0


def test_a_reboot_restarts_the_autopilot_and_a_shutdown_ends_it() -> None:
    with launched("iris", "--instance", str(INSTANCE)) as process, linked(0) as link:
        wait_for(link, "ATTITUDE", lambda attitude: attitude.time_boot_ms > 8000)
        command_power(link, 1)
        wait_for(link, "ATTITUDE", lambda attitude: attitude.time_boot_ms < 8000)
        wait_for(link, "HEARTBEAT", lambda heartbeat: heartbeat.system_status == 3)
        command_power(link, 2)
        assert process.wait(GONE_LIMIT_S) == 0


def test_a_vehicle_killed_is_named_and_the_others_fly_on() -> None:
    with launched("iris:2", "--instance", str(INSTANCE)) as process, linked(0) as one, linked(1) as other:
        for link in (one, other):
            wait_for(link, "HEARTBEAT", lambda _heartbeat: True)
        os.kill(children_of(process.pid)[1], signal.SIGKILL)
        assert process.stdout is not None
        assert any(f"iris (instance {INSTANCE + 1}) ended: killed by SIGKILL" in line for line in process.stdout)
        wait_until_free(gcs_port(1))
        killed_ms = wait_for(one, "ATTITUDE", lambda _attitude: True).time_boot_ms
        wait_for(one, "ATTITUDE", lambda attitude: attitude.time_boot_ms > killed_ms + 1000)
        process.send_signal(signal.SIGINT)
        assert process.wait(GONE_LIMIT_S) == 1
        wait_until_free(gcs_port(0))


def test_vehicles_of_one_process_reboot_and_are_shut_down_each_by_itself() -> None:
    with launched("iris:3", "--per-process", "3", "--instance", str(INSTANCE)) as process:
        assert children_of(process.pid) == []
        with contextlib.ExitStack() as stack:
            links = [stack.enter_context(linked(place)) for place in range(3)]
            for link in links:
                wait_for(link, "HEARTBEAT", lambda heartbeat: heartbeat.system_status == 3)
            booted_ms = wait_for(links[1], "ATTITUDE", lambda _: True).time_boot_ms
            command_power(links[0], 1)
            wait_for(links[0], "ATTITUDE", lambda attitude: attitude.time_boot_ms < booted_ms)
            command_power(links[2], 2, place=2)
            wait_until_free(gcs_port(2))
            for link in links[:2]:
                wait_for(link, "HEARTBEAT", lambda heartbeat: heartbeat.system_status == 3)
            assert wait_for(links[1], "ATTITUDE", lambda _: True).time_boot_ms > booted_ms
            for place in range(2):
                command_power(links[place], 2, place)
            assert process.wait(GONE_LIMIT_S) == 0
        assert process.stdout is not None
        said = process.stdout.read()
        assert [f"iris (instance {INSTANCE + place}) was shut down" in said for place in range(3)] == [True] * 3


def test_vehicles_in_a_world_share_one_process_and_stand_on_its_ground() -> None:
    with launched("iris:2", "--world", "corn_field", "--instance", str(INSTANCE)) as process:
        with linked(0) as one, linked(1) as other:
            heights = [wait_for(link, "HOME_POSITION", lambda _home: True).altitude for link in (one, other)]
        assert children_of(process.pid) == []
    assert heights[0] != heights[1] and abs(heights[0] - heights[1]) < 3000


def test_ctrl_c_leaves_no_process_and_no_port() -> None:
    with two_that_speak(in_background=True) as process:
        process.send_signal(signal.SIGINT)
        assert process.wait(GONE_LIMIT_S) == 0
        wait_until_free(gcs_port(0), gcs_port(1))


def test_vehicles_end_when_their_launcher_is_killed() -> None:
    with two_that_speak() as process:
        process.kill()
        wait_until_free(gcs_port(0), gcs_port(1))


def test_a_port_in_use_is_named_with_the_remedy() -> None:
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as holder:
        holder.bind(("0.0.0.0", gcs_port(0)))
        with launched("iris", "--instance", str(INSTANCE)) as process:
            assert process.wait(30.0) == 1
            assert process.stdout is not None
            said = process.stdout.read()
            assert f"UDP port {gcs_port(0)}" in said
            assert "--instance" in said


def test_vehicles_fly_on_when_nobody_can_read_what_is_printed(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-m", "sitl_emu", "launch", "iris", "--instance", str(INSTANCE)]
    command += ["--state", str(tmp_path)]
    with Path("/dev/full").open("w") as full, subprocess.Popen(command, stdout=full, stderr=subprocess.PIPE) as process:
        with linked(0) as link:
            end, heard = time.monotonic() + 30.0, None
            while heard is None and time.monotonic() < end and process.poll() is None:
                link.mav.heartbeat_send(6, 8, 0, 0, 4)
                heard = link.recv_match(type="HEARTBEAT", blocking=True, timeout=0.5)
        process.terminate()
        assert process.stderr is not None
        assert (process.stderr.read(), process.wait(GONE_LIMIT_S), heard is None) == (b"", 0, False)
