"""MAVProxy loads every parameter, lists a mission that was uploaded by it, and downloads a log."""

import os
import pathlib
import re
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from pyulog import ULog

from tests.interop.mavsdk_vehicle import IRIS_PARAMETERS
from tests.launched import launched

INSTANCE = 21
LIMIT_S = 120.0
SPEED = 0.2
"""So slow that MAVProxy keeps up on a busy machine: a log goes out by its vehicle's time. MAVProxy waits for ever for a
log of which it lost a datagram: when the gap is filled it asks for what lies beyond the end, which PX4 does not answer.
"""
DOWNLOADED = r"Finished downloading .*fetched\.ulg"
MISSION = """QGC WPL 110
0\t1\t3\t22\t0\t0\t0\t0\t47.397742\t8.545594\t10.0\t1
1\t0\t3\t16\t0\t0\t0\t0\t47.397842\t8.545594\t10.0\t1
"""


class MavProxy:
    """MAVProxy at a terminal: commands in, its output out."""

    def __init__(self, folder: pathlib.Path, master: str) -> None:
        command = [sys.executable, "-P", str(pathlib.Path(sys.executable).with_name("mavproxy.py"))]
        command += [f"--master={master}", "--state-basedir", str(folder), "--default-modules=param,wp,log"]
        self.log = folder / "mavproxy.txt"
        with self.log.open("w") as output:
            self.process = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=subprocess.STDOUT,
                text=True,
                env={**os.environ, "PYTHONWARNINGS": "ignore"},
            )

    def say(self, line: str) -> None:
        """Type a command."""
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def expect(self, pattern: str, limit_s: float = LIMIT_S) -> re.Match[str]:
        """Wait until the output matches."""
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            found = re.search(pattern, self.log.read_text())
            if found:
                return found
            time.sleep(0.1)
        raise TimeoutError(f"MAVProxy never printed {pattern!r}; it printed:\n{self.log.read_text()[-2000:]}")

    def close(self) -> None:
        """End it."""
        self.process.kill()
        self.process.wait()
        assert self.process.stdin is not None
        self.process.stdin.close()


@pytest.fixture
def mavproxy(tmp_path: pathlib.Path, request: pytest.FixtureRequest) -> Iterator[MavProxy]:
    """MAVProxy on the ground-station link of a launched quadrotor, at the speed that is the parameter."""
    speed = getattr(request, "param", 1.0)
    with launched("iris", "--instance", str(INSTANCE), "--speed", str(speed), "--state", str(tmp_path / "state")):
        proxy = MavProxy(tmp_path, f"udpout:127.0.0.1:{18570 + INSTANCE}")
        yield proxy
        proxy.close()


def test_mavproxy_loads_all_parameters_and_lists_a_mission(mavproxy: MavProxy, tmp_path: pathlib.Path) -> None:
    """All that PX4 announces, and the items as they were sent."""
    received = mavproxy.expect(r"Received (\d+) parameters")
    assert int(received[1]) == IRIS_PARAMETERS
    (tmp_path / "mission.txt").write_text(MISSION)
    mavproxy.say(f"wp load {tmp_path / 'mission.txt'}")
    # Until then PX4 is busy with it: "wp list" is another transfer.
    mavproxy.expect("Got MISSION_ACK: TYPE_MISSION: ACCEPTED")
    mavproxy.say("wp list")
    mavproxy.expect(r"22 6 47\.39774\d* 8\.5455\d* 10\.0")


@pytest.mark.parametrize("mavproxy", [SPEED], indirect=True)
def test_mavproxy_downloads_a_log(mavproxy: MavProxy, tmp_path: pathlib.Path) -> None:
    """The log that began at boot: as many of its bytes as it had when it was listed."""
    mavproxy.expect(r"Received \d+ parameters")
    mavproxy.say("log list")
    mavproxy.expect(r"Log 0  numLogs 1 lastLog 1 size \d+")
    fetched = tmp_path / "fetched.ulg"
    mavproxy.say(f"log download 0 {fetched}")
    mavproxy.expect(DOWNLOADED)
    (onboard,) = (tmp_path / "state").rglob("*.ulg")
    data = fetched.read_bytes()
    assert data == onboard.read_bytes()[: len(data)]
    assert ULog(str(fetched)).initial_parameters["MAV_SYS_ID"] == INSTANCE + 1
