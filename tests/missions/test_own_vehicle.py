"""examples/own_vehicle, copied away from the checkout, flies as its file says: own folder, wind, sensors, faults."""

import json
import shutil
import sys
import time
from pathlib import Path

import pytest
from pymavlink import mavutil

from sitl_emu import vehicles
from sitl_emu.core import ports
from sitl_emu.core.simulator_api import HilSensor
from sitl_emu.run.scenario import load
from tests.launched import launched
from tests.missions.runs import FIRST_INSTANCE, Run
from tests.missions.test_world_command import connected, started

ROOT = Path(__file__).parents[2]


def test_a_vehicle_of_ones_own_flies_its_scenario_outside_the_checkout(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples/own_vehicle", tmp_path / "own_vehicle")
    shutil.copy(ROOT / "examples/own_companion.py", tmp_path)
    with Run(Path("own_vehicle/flight.yaml"), tmp_path / "run", "--speed", "2", cwd=tmp_path) as run:
        assert run.wait(200) == 0, run.text + (tmp_path / "run/logs/companion-uas.log").read_text()
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert summary["outcome"] == "success" and len(summary["faults"]) == 1 and not summary["faults_left"]
    events = [json.loads(line) for line in (tmp_path / "run/events.jsonl").read_text().splitlines()]
    at = {f"{event['event']} {event.get('text', '')}".strip(): event["time_s"] for event in events}
    assert at["fault mag off"] - at["armed"] == pytest.approx(8.0)
    assert at["fault_ended mag on again"] - at["fault mag off"] == pytest.approx(5.0)
    rows = [row.split(",") for row in (tmp_path / "run/truth-uas.csv").read_text().splitlines()[1:]]
    assert max(-float(row[3]) for row in rows) > 2.0, "it took off, to MIS_TAKEOFF_ALT"
    assert -float(rows[-1][3]) < 0.5, "and landed"


def test_the_example_is_an_iris_but_for_what_it_says() -> None:
    asked = load(ROOT / "examples/own_vehicle/flight.yaml").vehicles[0].model_data
    mine, iris = vehicles.load(asked.model), vehicles.load("iris")
    assert mine.mass_kg == iris.mass_kg + 0.4 and mine.propulsion == iris.propulsion
    assert {name for name in iris.airframe if mine.airframe[name] != iris.airframe[name]} == {"MPC_THR_HOVER"}


def test_it_is_launched_and_served_by_its_folder_too(tmp_path: Path) -> None:
    mine = str(ROOT / "examples/own_vehicle/my_quad")
    with launched(mine, "--instance", str(FIRST_INSTANCE), "--state", str(tmp_path)) as vehicle:
        assert vehicle.stdout is not None
        link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{ports.gcs(FIRST_INSTANCE).local}", source_system=255)
        until, told = time.monotonic() + 60.0, None
        while told is None:
            assert time.monotonic() < until and vehicle.poll() is None
            link.mav.heartbeat_send(6, 8, 0, 0, 4)
            link.mav.param_request_read_send(FIRST_INSTANCE + 1, 1, b"MPC_THR_HOVER", -1)
            told = link.recv_match(type="PARAM_VALUE", blocking=True, timeout=1.0)
        assert (told.param_id, told.param_value) == ("MPC_THR_HOVER", pytest.approx(0.67))
        link.close()
    assert (tmp_path / f"my_quad-{FIRST_INSTANCE}").is_dir()
    command = [sys.executable, "-P", "-m", "sitl_emu", "world", "flat", "--vehicle", mine, "--instance", "45"]
    with started(command) as world:
        channel = connected(45)
        assert isinstance(channel.receive()[-1], HilSensor)
        channel.close()
        assert "the world ends" in world.communicate(timeout=30)[0]
