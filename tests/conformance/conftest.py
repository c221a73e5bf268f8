"""An autopilot to measure: any on a MAVLink URL, or an emulator of our own, started for these tests.

    SITL_EMU_CONFORMANCE_URL=udpout:127.0.0.1:18570 pytest tests/conformance

measures what listens there (a real PX4 SITL, too). Nothing of the product is imported: numbers are PX4's, as literals.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from typing import Any

import pytest
from pymavlink import mavutil

URL_VARIABLE = "SITL_EMU_CONFORMANCE_URL"
INSTANCE = 8
READY_LIMIT_S = 60.0
REPLY_LIMIT_S = 3.0
STANDBY = 3
DO_SET_MODE = 176
CUSTOM_MODE_ENABLED = 1


class Station:
    """A ground station, 255/190, on one link of an autopilot."""

    def __init__(self, url: str) -> None:
        self.link: Any = mavutil.mavlink_connection(url, source_system=255, source_component=190, dialect="common")
        self.mav = self.link.mav
        self.system = 0
        self._heartbeat_s = 0.0

    def wait_until_ready(self) -> None:
        """Until the autopilot is in standby."""
        end_s = time.monotonic() + READY_LIMIT_S
        while time.monotonic() < end_s:
            heartbeat = self.receive("HEARTBEAT", 1.5)
            if heartbeat is not None and heartbeat.get_srcComponent() == 1 and heartbeat.system_status == STANDBY:
                self.system = heartbeat.get_srcSystem()
                return
        raise TimeoutError(f"no autopilot in standby within {READY_LIMIT_S:.0f} s")

    def receive(self, name: str | list[str], limit_s: float = REPLY_LIMIT_S) -> Any:
        """The next message of a name from the autopilot, or None; heartbeats go out meanwhile."""
        end_s = time.monotonic() + limit_s
        while (left_s := end_s - time.monotonic()) > 0.0:
            if time.monotonic() - self._heartbeat_s > 1.0:
                self._heartbeat_s = time.monotonic()
                self.mav.heartbeat_send(6, 8, 0, 0, 0)
            message = self.link.recv_match(type=name, blocking=True, timeout=min(left_s, 0.5))
            if message is not None:
                return message
        return None

    def collect(self, name: str, seconds: float) -> list[Any]:
        """All messages of a name within a time."""
        end_s = time.monotonic() + seconds
        found = []
        while (left_s := end_s - time.monotonic()) > 0.0:
            message = self.receive(name, left_s)
            if message is not None:
                found.append(message)
        return found

    def command(self, number: int, *params: float) -> int | None:
        """Send a COMMAND_LONG; the result of its ack, or None."""
        padded = params + (0.0,) * (7 - len(params))
        self.mav.command_long_send(self.system, 1, number, 0, *padded)
        while (ack := self.receive("COMMAND_ACK")) is not None:
            if ack.command == number:
                return int(ack.result)
        return None

    def set_mode(self, main: int, sub: int) -> None:
        """Choose a mode, and see it in the heartbeat."""
        assert self.command(DO_SET_MODE, CUSTOM_MODE_ENABLED, main, sub) == 0
        assert self.heartbeat().custom_mode == main << 16 | sub << 24

    def heartbeat(self) -> Any:
        """The next heartbeat of the autopilot that was sent after this call."""
        while self.link.recv_match(blocking=False) is not None:
            pass
        return self.receive("HEARTBEAT")


@pytest.fixture(scope="session")
def station() -> Iterator[Station]:
    """A station whose autopilot is ready."""
    url = os.environ.get(URL_VARIABLE)
    process = None
    if not url:
        url = f"udpout:127.0.0.1:{18570 + INSTANCE}"
        command = [sys.executable, "-P", "-m", "sitl_emu", "launch", "sihsim_hex", "--instance", str(INSTANCE)]
        state = tempfile.TemporaryDirectory(prefix="sitl_emu-")
        process = subprocess.Popen([*command, "--state", state.name], stdout=subprocess.DEVNULL)
    found = None
    try:
        found = Station(url)
        found.wait_until_ready()
        yield found
    finally:
        if found is not None:
            found.link.close()
        if process is not None:
            process.terminate()
            process.wait(10.0)
            state.cleanup()
