"""A ground station sees both vehicles of a mission; when its pilot chooses another mode, the companion yields."""

import json
import socket
import time
from pathlib import Path

from pymavlink import mavutil

from tests.missions.runs import FIRST_INSTANCE, Run, short_scenario

DO_SET_MODE, CUSTOM_MODE_ENABLED, AUTO, LOITER = 176, 1, 4, 3
AUTOPILOT, CAMERA, GIMBAL, COMPANION = 1, 100, 154, 191
UAS, UGV = FIRST_INSTANCE + 1, FIRST_INSTANCE + 2


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", 0))
        return int(opened.getsockname()[1])


def blind(folder: Path) -> Path:
    """The scenario with hardly a frame: quick, and as good for a pilot."""
    path = short_scenario(folder, 600.0)
    path.write_text(path.read_text().replace("rate_hz: 15", "rate_hz: 0.5"))
    return path


def test_a_pilot_at_the_ground_station_takes_the_scout_over(tmp_path: Path) -> None:
    port, heard, texts, asked = free_port(), set[tuple[int, int]](), list[str](), False
    station = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=255)
    with Run(blind(tmp_path), tmp_path / "run", "--speed", "8", "--gcs", f"127.0.0.1:{port}") as run:
        until = time.monotonic() + 90.0
        while not any("yields" in text for text in texts):
            assert time.monotonic() < until and run.process.poll() is None, run.text
            message = station.recv_match(blocking=True, timeout=1.0)
            if message is None:
                continue
            source = (message.get_srcSystem(), message.get_srcComponent())
            if message.get_type() == "HEARTBEAT":
                heard.add(source)
            elif message.get_type() == "STATUSTEXT":
                texts.append(message.text)
            elif message.get_type() == "MISSION_CURRENT" and source[0] == UAS and message.seq >= 2 and not asked:
                asked = True
                mode = (CUSTOM_MODE_ENABLED, AUTO, LOITER)
                station.mav.command_long_send(UAS, AUTOPILOT, DO_SET_MODE, 0, *mode, 0, 0, 0, 0)
        both = {(system, component) for system in (UAS, UGV) for component in (AUTOPILOT, COMPANION, CAMERA)}
        assert heard == both | {(UAS, GIMBAL)}
    station.close()
    events = [json.loads(line) for line in (tmp_path / "run/events.jsonl").read_text().splitlines()]
    assert [event["vehicle"] for event in events if event["event"] == "yielded"] == ["uas"]
