"""A ground station sees both vehicles of a mission; a pilot or a failsafe takes one, and its companion says which."""

import json
import socket
import struct
import time
from pathlib import Path

from pymavlink import mavutil

from tests.missions.runs import FIRST_INSTANCE, Run, short_scenario

DO_SET_MODE, CUSTOM_MODE_ENABLED, AUTO, LOITER = 176, 1, 4, 3
AUTOPILOT, CAMERA, GIMBAL, COMPANION = 1, 100, 154, 191
RETURN_BY_FENCE, INT32, REAL32 = 3, 6, 9
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
    assert any("pilot took over" in text for text in texts) and not any("failsafe" in text for text in texts)
    assert yielded(tmp_path / "run") == [("uas", "pilot", "hold")]


def yielded(folder: Path) -> list[tuple[str, str, str]]:
    """(vehicle, by whom, mode) of what the companions yielded to."""
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    return [(event["vehicle"], event["by"], event["mode"]) for event in events if event["event"] == "yielded"]


def test_a_geofence_that_sends_the_scout_home_is_told_as_a_failsafe(tmp_path: Path) -> None:
    """GF_MAX_HOR_DIST is set to 5 m in flight: PX4 waits in Hold (COM_FAIL_ACT_T), and returns the UAS then."""
    port, texts, asked = free_port(), list[str](), False
    station = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=255)
    with Run(blind(tmp_path), tmp_path / "run", "--speed", "8", "--gcs", f"127.0.0.1:{port}") as run:
        until = time.monotonic() + 90.0
        while not any("yields" in text for text in texts):
            assert time.monotonic() < until and run.process.poll() is None, run.text
            message = station.recv_match(type=["STATUSTEXT", "MISSION_CURRENT"], blocking=True, timeout=1.0)
            if message is not None and message.get_type() == "STATUSTEXT":
                texts.append(message.text)
            elif message is not None and message.get_srcSystem() == UAS and message.seq >= 2 and not asked:
                asked = True
                for name, value, kind in (
                    (b"GF_ACTION", integer(RETURN_BY_FENCE), INT32),
                    (b"GF_MAX_HOR_DIST", 5.0, REAL32),
                ):
                    station.mav.param_set_send(UAS, AUTOPILOT, name, value, kind)
    station.close()
    assert any("failsafe (geofence)" in text for text in texts) and not any("pilot" in text for text in texts)
    assert yielded(tmp_path / "run") == [("uas", "failsafe", "hold")]


def integer(value: int) -> float:
    """An integer parameter as PX4 takes it: its bytes in the float's place."""
    return float(struct.unpack("<f", struct.pack("<i", value))[0])
