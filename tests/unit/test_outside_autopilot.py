"""What an autopilot from outside is told at its start, and what is said of a wrong one."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from sitl_emu import vehicles
from sitl_emu.run import preflight
from sitl_emu.run.outside_autopilot import environment
from sitl_emu.run.scenario import Scenario, ScenarioError, load
from sitl_emu.run.trouble import Trouble

PX4 = {"command": ["./px4", "-i", "{instance}"], "env": {"PX4_SYS_AUTOSTART": 10016, "HOME": "{rootfs}"}}


def scenario(folder: Path, autopilot: Any) -> Scenario:
    path = folder / "s.yaml"
    uas = {"name": "uas", "model": "iris", "autopilot": autopilot}
    path.write_text(yaml.safe_dump({"name": "s", "world": {"kind": "flat"}, "vehicles": [uas]}))
    return load(path)


def test_the_airframe_goes_to_it_as_px4s_parameters(tmp_path: Path) -> None:
    part = scenario(tmp_path, PX4).vehicles[0].autopilot
    assert part is not None
    given = environment(vehicles.load("m600"), part.environment, {"rootfs": "/run/rootfs/uas"})
    assert given["PX4_SYS_AUTOSTART"] == "10016" and given["HOME"] == "/run/rootfs/uas"
    airframe = {name.removeprefix("PX4_PARAM_"): value for name, value in given.items() if "PX4_PARAM_" in name}
    assert airframe["CA_ROTOR_COUNT"] == "6" and airframe["PWM_MAIN_FUNC6"] == "106", "actuators' order"
    assert airframe["MC_ROLLRATE_P"] == "0.09" and airframe["MAV_TYPE"] == "13"
    assert not {"SYS_AUTOSTART", "CAL_GYRO0_ID", "SENS_EN_GPSSIM", "SIM_GPS_USED", "SDLOG_MODE"} & airframe.keys()


def test_what_a_scenario_gives_goes_before_the_airframe() -> None:
    given = environment(vehicles.load("iris"), {"PX4_PARAM_MPC_THR_HOVER": "0.4"}, {})
    assert given["PX4_PARAM_MPC_THR_HOVER"] == "0.4"


@pytest.mark.parametrize(
    ("autopilot", "said"),
    [
        ({"command": []}, "autopilot.command: .*: List should have at least 1 item"),
        ({"env": {}}, "autopilot.command: this field is missing"),
        ({"comand": ["px4"], "command": ["px4"]}, "autopilot.comand: unknown field; allowed here: command, env"),
        ("px4", "autopilot: 'px4': must be a mapping with the fields command, env"),
        ({"command": ["px4"], "env": [1]}, r"autopilot.env: \[1\]: must be a mapping"),
    ],
)
def test_a_wrong_one_is_told(tmp_path: Path, autopilot: Any, said: str) -> None:
    with pytest.raises(ScenarioError, match=r"vehicles.0." + said):
        scenario(tmp_path, autopilot)


def test_a_program_that_is_not_there_is_told_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(Trouble, match=r"autopilot uas: can't start './no-px4': there is no such program"):
        preflight.check(scenario(tmp_path, {"command": ["./no-px4"]}), 100)


def test_a_program_beside_the_scenario_is_found_from_anywhere(tmp_path: Path) -> None:
    (tmp_path / "px4").touch()
    part = scenario(tmp_path, {"command": ["./px4", "-i", "{instance}"]}).vehicles[0].autopilot
    assert part is not None and part.command == [str(tmp_path / "px4"), "-i", "{instance}"]
