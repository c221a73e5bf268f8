"""`sitl-emu conformance` measures a launched vehicle: progress, summary, report, exit status."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.conformance.station import Station
from tests.launched import launched

INSTANCE = 24
LIMIT_S, READY_S, POINTED_S = 300.0, 60.0, 3.0
CONFIGURE, PITCHYAW, NAN = 1001, 1000, float("nan")


def conformance(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "sitl_emu", "conformance", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)


def test_one_service_alone_twice_and_another_on_another_vehicle(tmp_path: Path) -> None:
    report = tmp_path / "page.html"
    with launched("rover", "--instance", str(INSTANCE)):
        url = f"udpout:127.0.0.1:{18570 + INSTANCE}"
        first = conformance(url, "--service", "ping", "--service", "gimbal_manager", "--report", str(report))
        second = conformance(url, "--service", "ping")
    assert (first.returncode, second.returncode) == (0, 0), first.stdout + first.stderr + second.stderr
    lines = first.stdout.splitlines()
    assert lines[0].split() == ["ping", "..", "2", "of", "2", "passed"]
    assert lines[2] == "skipped: 1: this vehicle has no gimbal"
    assert f"MAV_TYPE_GROUND_ROVER, system {INSTANCE + 1} on {url}: 3 of 4 passed, 0 failed, 1 skipped" in lines[3]
    assert "MAV_TYPE_GROUND_ROVER" in report.read_text()


def test_an_autopilot_that_is_not_there_is_told_in_a_line() -> None:
    run = conformance("udpout:127.0.0.1:9", "--service", "ping")
    assert run.returncode == 2
    assert run.stderr.startswith("sitl-emu: udpout:127.0.0.1:9: ")
    assert run.stderr.count("\n") == 1


def test_an_autopilot_that_goes_away_ends_the_run_with_what_came_out_until_then() -> None:
    url = f"udpout:127.0.0.1:{18570 + INSTANCE}"
    command = [sys.executable, "-P", "-m", "sitl_emu", "conformance", url]
    with launched("rover", "--instance", str(INSTANCE)):
        run = subprocess.Popen(
            [*command, "--service", "ping", "--service", "message_interval"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert run.stdout is not None
        assert run.stdout.readline().split() == ["ping", "..", "2", "of", "2", "passed"]
    told, trouble = run.communicate(timeout=LIMIT_S)
    assert run.returncode == 2
    assert "1 failed" in told.splitlines()[-1]
    assert trouble.startswith("sitl-emu: the autopilot was lost after test test_message_interval::test_")
    assert trouble.count("\n") == 1


def pointed(station: Station) -> tuple[int, int, float]:
    """Who controls the gimbal, and its pitch, as the quaternion has it."""
    status, attitude = station.receive("GIMBAL_MANAGER_STATUS"), station.receive("GIMBAL_DEVICE_ATTITUDE_STATUS")
    return status.primary_control_sysid, status.primary_control_compid, attitude.q[2]


def test_a_camera_and_a_gimbal_speak_their_protocols_and_the_gimbal_is_left_as_it_was() -> None:
    url = f"udpout:127.0.0.1:{18570 + INSTANCE}"
    with launched("m600", "--instance", str(INSTANCE)):
        station = Station(url)
        station.wait_until_ready(READY_S)
        for command, *params in ((CONFIGURE, 255, 190, -1, -1), (PITCHYAW, -50.0, 0.0, NAN, NAN), (CONFIGURE, 42, 191)):
            assert station.command(command, *params) == 0
        station.collect("HEARTBEAT", POINTED_S)
        before = pointed(station)
        station.link.close()
        run = conformance(url, *(f"--service={name}" for name in ("camera", "gimbal_manager")))
        station = Station(url)
        station.wait_until_ready(READY_S)
        assert pointed(station) == pytest.approx(before, abs=0.01)
        station.link.close()
    assert before[:2] == (42, 191)
    assert run.returncode == 0, run.stdout + run.stderr
    assert run.stdout.splitlines()[0].split()[-4:] == ["9", "of", "10", "passed"]
