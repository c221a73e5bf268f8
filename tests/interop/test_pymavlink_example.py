"""examples/pymavlink_mission.py with several vehicles on its port, and with one that refuses: stand-ins, by UDP."""

import contextlib
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sitl_emu.core import dialect as mavlink
from tests.unit.companion_px4 import STEP_US, FakePx4

EXAMPLE = Path(__file__).parents[2] / "examples/pymavlink_mission.py"
ARM, HEXAROTOR = 400, 13
TEMPORARILY_REJECTED = 1
LIMIT_S = 60.0
STEP_S = 0.001
"""Of the clock, for a step of a vehicle: they fly twenty times as fast as real ones."""


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
    return port


class OnUdp(threading.Thread):
    """A vehicle that speaks to a ground station's port."""

    def __init__(self, system: int, port: int) -> None:
        super().__init__()
        self.px4 = FakePx4(system, HEXAROTOR, 0.0, 0.0, speed_m_s=10.0)
        self._port, self._ends = port, threading.Event()

    def run(self) -> None:
        wire: Any = mavlink.MAVLink(None)
        now_us = 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.setblocking(False)
            while not self._ends.is_set():
                now_us += STEP_US
                messages = self.px4.on_time(now_us)
                with contextlib.suppress(OSError):
                    while True:
                        for heard in wire.parse_buffer(link.recv(4096)) or []:
                            messages += self.px4.on_message(now_us, heard)
                with contextlib.suppress(OSError):
                    for message in messages:
                        link.sendto(bytes(message.get_msgbuf()), ("127.0.0.1", self._port))
                time.sleep(STEP_S)

    def end(self) -> None:
        self._ends.set()
        self.join()


@contextlib.contextmanager
def flown(count: int) -> Iterator[tuple[list[FakePx4], list[str]]]:
    """Vehicles in the air, and the command line of the example that flies one of them."""
    port = free_port()
    vehicles = [OnUdp(system, port) for system in range(1, count + 1)]
    for vehicle in vehicles:
        vehicle.start()
    try:
        yield [each.px4 for each in vehicles], [sys.executable, "-W", "ignore", str(EXAMPLE), f"udpin:127.0.0.1:{port}"]
    finally:
        for vehicle in vehicles:
            vehicle.end()


def test_one_of_two_vehicles_is_flown_until_it_has_landed() -> None:
    with flown(2) as (vehicles, command):
        run = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.splitlines() == [
        "5 items uploaded",
        *(f"item {seq} reached" for seq in range(4)),
        "landed",
    ]
    one, other = sorted(vehicles, key=lambda each: not each.commands)
    assert [number for number, _ in one.commands] == [176, 400] and not one.armed
    assert not other.commands


def test_a_vehicle_that_refuses_to_arm_ends_it_with_a_line() -> None:
    with flown(1) as ((vehicle,), command):
        vehicle.ack = lambda number: TEMPORARILY_REJECTED if number == ARM else 0
        run = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)
    assert (run.returncode, run.stderr) == (1, "arming was refused: MAV_RESULT_TEMPORARILY_REJECTED\n")
