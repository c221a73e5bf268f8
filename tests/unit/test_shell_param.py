"""The shell's `param`: shows, changes, saves and counts parameters."""

import re
from pathlib import Path

import pytest

from tests.unit.shell_console import Console


def test_param_shows_sets_and_resets() -> None:
    console = Console()
    assert console.output("param show -q MPC_XY_P") == "0.9500\n"
    shown = console.output("param show mpc_xy_p")
    assert shown.startswith("Symbols: x = used, + = saved, * = unsaved, l = locked\nx     MPC_XY_P [")
    assert "] : 0.9500\n" in shown
    assert console.output("param show -l").count("\n") == 1
    assert shown.splitlines()[-1].endswith("parameters used.")
    assert console.output("param show COM_D*").count("] : ") == 4
    assert console.output("param set MPC_XY_P 1.2") == "  MPC_XY_P: curr: 0.9500 -> new: 1.2000\n"
    assert console.output("param set MPC_XY_P 1.2") == ""
    assert console.autopilot.parameters["MPC_XY_P"] == pytest.approx(1.2)
    assert "x *   MPC_XY_P" in console.output("param show -c")
    console.output("param save")
    assert "x +   MPC_XY_P" in console.output("param show -c")
    assert console.output("param set MPC_XY_P 1.3") == "+ MPC_XY_P: curr: 1.2000 -> new: 1.3000\n"
    assert console.output("param set MPC_XY_P 1.2") == "* MPC_XY_P: curr: 1.3000 -> new: 1.2000\n"
    assert console.output("param compare MPC_XY_P 1.2") == ""
    assert console.output("param greater MPC_XY_P 1.2") == "Command 'param' failed, returned 1.\n"
    console.output("param reset mpc_xy*")
    assert console.autopilot.parameters["MPC_XY_P"] == pytest.approx(1.2)
    console.output("param reset MPC_XY*")
    assert console.autopilot.parameters["MPC_XY_P"] == pytest.approx(0.95)
    assert console.output("param set NO_SUCH 1") == "ERROR [param] Parameter NO_SUCH not found.\n"
    assert "failed, returned 1" in console.output("param set NO_SUCH 1 fail")


@pytest.mark.parametrize("line", ["set ASPD_TAS_NOISE 20", "compare ASPD_TAS_NOISE 20", "touch ASPD_TAS_NOISE"])
def test_a_parameter_that_is_set_compared_or_touched_is_in_use(line: str) -> None:
    console = Console()
    parameters = console.autopilot.parameters
    count = len(parameters.announced)
    assert console.output("param find ASPD_TAS_NOISE") and console.output("param show -q ASPD_TAS_NOISE")
    assert "ASPD_TAS_NOISE" not in parameters.index
    console.output(f"param {line}")
    assert "ASPD_TAS_NOISE" in parameters.index and len(parameters.announced) == count + 1


def test_param_set_default_changes_what_nobody_has_set() -> None:
    console = Console()
    parameters = console.autopilot.parameters
    parameters.set("MPC_Z_P", 0.5)
    version = parameters.version
    assert console.output("param set-default MPC_XY_P 1.5") + console.output("param set-default MPC_Z_P 1.5") == ""
    assert (parameters["MPC_XY_P"], parameters["MPC_Z_P"], parameters.default("MPC_Z_P")) == (1.5, 0.5, 1.5)
    assert parameters.version > version and set(parameters.changed()) - set(parameters.set_at_start) == {"MPC_Z_P"}
    assert console.output("param reset MPC_Z_P") == "" and parameters["MPC_Z_P"] == 1.5
    assert console.output("param set-default NO_SUCH 1").endswith("not found.\nCommand 'param' failed, returned -1.\n")
    assert console.output("param set-default -s NO_SUCH 1") == "Command 'param' failed, returned 1.\n"
    assert "Try 'param set-default X 3'" in console.output("param set-default X")


def test_param_saves_into_a_file_and_takes_from_it(tmp_path: Path) -> None:
    console = Console(root=tmp_path)
    (tmp_path / "log").mkdir()
    parameters = console.autopilot.parameters
    parameters.set("MPC_XY_P", 1.25)
    assert console.output("param save mine.bson") == "" and (tmp_path / "mine.bson").exists()
    parameters.set("MPC_XY_P", 0.75)
    parameters.set("MPC_Z_P", 0.5)
    printed = console.output("param import mine.bson")
    assert printed == (
        "INFO  [param] importing from 'mine.bson'\n"
        "INFO  [parameters] BSON document size 330 bytes, decoded 330 bytes (INT32:13, FLOAT:4)\n"
    )
    assert (parameters["MPC_XY_P"], parameters["MPC_Z_P"]) == (1.25, 0.5)
    assert console.output("param load mine.bson").startswith("INFO  [parameters] BSON document size 330 bytes")
    assert (parameters["MPC_XY_P"], parameters["MPC_Z_P"]) == (1.25, parameters.default("MPC_Z_P"))
    assert console.output("param load nothing.bson").startswith("ERROR [param] open 'nothing.bson' failed (2)\n")
    assert console.output("param load ../mine.bson").startswith("ERROR [param] open '../mine.bson' failed (13)\n")
    assert console.output("param load log").startswith("ERROR [param] open 'log' failed (21)\n")
    assert console.output("param save .").startswith("ERROR [param] exporting to '.' failed (-1)\n")
    assert console.output("param save /etc/x").startswith("ERROR [param] exporting to '/etc/x' failed (-1)\n")


def test_param_status_counts_what_is_used_changed_and_the_airframes() -> None:
    console = Console()
    console.autopilot.parameters.set("MPC_XY_P", 1.2)
    lines = console.output("param status").splitlines()
    assert lines[1:4] == [
        "INFO  [parameters] file: parameters.bson",
        "INFO  [parameters] backup file: parameters_backup.bson",
        "INFO  [parameters] storage array: 17/1864 elements (256 bytes total)",
    ]
    assert re.fullmatch(r"INFO  \[parameters\] storage array \(custom defaults\): \d+/1864 .*", lines[4])
    assert lines[5] == "INFO  [parameters] auto save: on"


def test_param_lists_for_an_airframe_what_is_in_use_and_no_counters() -> None:
    console = Console()
    parameters = console.autopilot.parameters
    parameters.load({"ASPD_TAS_NOISE": 1.0, "LND_FLIGHT_T_LO": 7, "SENS_DPRES_OFF": 1.0, "RC1_MIN": 900.0})
    parameters.load({"MPC_XY_P": 1.2})
    lines = console.output("param show-for-airframe").splitlines()
    assert lines[:3] == [
        "param set-default COM_RC_LOSS_T 1.0000",
        "param set-default MPC_XY_P 1.2000",
        "param set-default SENS_BOARD_X_OFF 0.0000",
    ]
    assert lines[3].startswith("# Make sure to add")


def test_param_takes_what_c_takes_for_a_number() -> None:
    console = Console()
    for text, value in (("12abc", 12), ("abc", 0), ("-7.9", -7), ("99999999999", 1215752191), ("1_0", 1)):
        console.output(f"param set COM_FLIGHT_UUID {text}")
        assert console.autopilot.parameters["COM_FLIGHT_UUID"] == value
    console.output("param set MPC_XY_P 1.5rest")
    assert console.autopilot.parameters["MPC_XY_P"] == pytest.approx(1.5)
