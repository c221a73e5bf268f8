"""Parameters from one start to the next: the file, when it is written, and what happens when it is damaged."""

import struct
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.parameters import file as parameter_file
from sitl_emu.autopilot.parameters.storage import ParameterStorage
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.vehicle_kind import VehicleKind

DOCUMENT = (
    b"\x2c\0\0\0\x01MPC_XY_CRUISE\0" + struct.pack("<d", 6.5) + b"\x10COM_RC_IN_MODE\0" + struct.pack("<i", 2) + b"\0"
)
"""Two parameters as PX4's tinybson writes them."""


SET = {
    "CAL_ACC0_ID": 1310988,
    "CAL_MAG0_PRIO": 50,
    "MAV_SYS_ID": 3,
    "SENS_DPRES_OFF": pytest.approx(0.001),
    "SYS_AUTOSTART": 10044,
}
"""What a first start sets of this airframe."""


class Start:
    """One start of an autopilot with a folder; `said` is what it told."""

    def __init__(self, root: Path | None, airframe: int = 10044) -> None:
        self.said: list[str] = []
        given = {"CAL_ACC0_ID": 1310988, "CAL_MAG0_PRIO": 50, "SENS_DPRES_OFF": 0.001, "SYS_AUTOSTART": airframe}
        self.parameters = Parameters(VehicleKind.MULTICOPTER, {**given, "MAV_SYS_ID": 3})
        self.storage = ParameterStorage(self.parameters, root, self._say)
        self.storage.boot()
        self.now_us = 0

    def _say(self, severity: Severity, text: str) -> None:
        self.said.append(text)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 50)):
            self.now_us += 20_000
            self.storage.update(self.now_us)


def test_the_file_is_px4s() -> None:
    document = parameter_file.encode({"MPC_XY_CRUISE": 6.5, "COM_RC_IN_MODE": 2})
    assert document == struct.pack("<i", len(document)) + DOCUMENT[4:]
    assert parameter_file.decode(document) == ({"MPC_XY_CRUISE": 6.5, "COM_RC_IN_MODE": 2}, True)


@pytest.mark.parametrize("cut", range(len(DOCUMENT)))
def test_a_cut_file_is_damaged(cut: int) -> None:
    document = parameter_file.encode({"MPC_XY_CRUISE": 6.5, "COM_RC_IN_MODE": 2})
    values, whole = parameter_file.decode(document[:cut])
    assert whole is (cut == 0)
    assert set(values.items()) <= {("MPC_XY_CRUISE", 6.5), ("COM_RC_IN_MODE", 2)}


def test_a_change_is_saved_after_300_ms_and_there_at_the_next_start(tmp_path: Path) -> None:
    start = Start(tmp_path)
    start.parameters.set("MPC_XY_CRUISE", 6.5)
    start.parameters.set("COM_RC_IN_MODE", 2)
    start.run(0.28)
    assert not (tmp_path / storage.PARAMETERS).exists()
    assert start.parameters.unsaved == {"MPC_XY_CRUISE", "COM_RC_IN_MODE", "SYS_AUTOCONFIG", *SET}
    start.run(0.06)
    assert start.parameters.unsaved == set()
    assert parameter_file.decode((tmp_path / storage.PARAMETERS).read_bytes())[0] == {
        "COM_RC_IN_MODE": 2,
        "MPC_XY_CRUISE": 6.5,
        **SET,
    }
    again = Start(tmp_path)
    assert (again.parameters["MPC_XY_CRUISE"], again.parameters["COM_RC_IN_MODE"]) == (6.5, 2)
    assert again.said == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["parameters.bson", "parameters_backup.bson"]


def test_it_is_saved_every_2_s_at_most(tmp_path: Path) -> None:
    start = Start(tmp_path)
    saves = []
    for step in range(100):
        start.parameters.set("MPC_XY_CRUISE", 4.0 + step / 100)
        start.run(0.1)
        if not start.parameters.unsaved:
            saves.append(start.now_us / 1e6)
    assert len(saves) in (4, 5)


def test_what_waits_is_saved_at_the_end(tmp_path: Path) -> None:
    start = Start(tmp_path)
    start.parameters.set("MPC_XY_CRUISE", 6.5)
    start.storage.close()
    assert Start(tmp_path).parameters["MPC_XY_CRUISE"] == 6.5


def test_a_value_set_back_leaves_the_file(tmp_path: Path) -> None:
    start = Start(tmp_path)
    start.parameters.set("MPC_XY_CRUISE", 6.5)
    start.run(1.0)
    start.parameters.set("MPC_XY_CRUISE", start.parameters.default("MPC_XY_CRUISE"))
    start.run(3.0)
    assert parameter_file.decode((tmp_path / storage.PARAMETERS).read_bytes()) == (SET, True)


def test_a_damaged_file_gives_way_to_its_backup_and_is_mended(tmp_path: Path) -> None:
    start = Start(tmp_path)
    start.parameters.set("MPC_XY_CRUISE", 6.5)
    start.run(1.0)
    file = tmp_path / storage.PARAMETERS
    file.write_bytes(file.read_bytes()[:-3])
    again = Start(tmp_path)
    assert again.parameters["MPC_XY_CRUISE"] == 6.5
    assert again.said == ["Parameters not loaded: parameters.bson is damaged"]
    again.run(1.0)
    assert Start(tmp_path).said == []


def test_with_both_files_damaged_the_defaults_count(tmp_path: Path) -> None:
    for name in (storage.PARAMETERS, storage.PARAMETERS_BACKUP):
        (tmp_path / name).write_bytes(b"\xff" * 40)
    start = Start(tmp_path)
    assert start.parameters.changed() == SET
    assert len(start.said) == 2


def test_unknown_names_wrong_types_and_what_belongs_to_the_start_are_left_out(tmp_path: Path) -> None:
    values = {"NO_SUCH_PARAM": 1, "MPC_XY_CRUISE": 6, "COM_RC_IN_MODE": 2.0, "SYS_AUTOSTART": 1, "MAV_SYS_ID": 9}
    (tmp_path / storage.PARAMETERS).write_bytes(parameter_file.encode(values))
    start = Start(tmp_path)
    assert start.parameters.changed() == SET
    assert (start.parameters["SYS_AUTOSTART"], start.parameters["MAV_SYS_ID"]) == (10044, 3)


def test_autoconfig_resets_all_but_calibration_and_counters(tmp_path: Path) -> None:
    start = Start(tmp_path)
    values = {"MPC_XY_CRUISE": 6.5, "COM_FLTMODE1": 2, "RC1_MIN": 900.0, "CAL_ACC0_XOFF": 0.1, "COM_FLIGHT_UUID": 4}
    for name, value in {"SYS_AUTOCONFIG": 1, **values}.items():
        start.parameters.set(name, value)
    start.storage.close()
    again = Start(tmp_path)
    assert again.parameters.changed() == {**SET, "CAL_ACC0_XOFF": pytest.approx(0.1), "COM_FLIGHT_UUID": 4}


def test_another_airframe_begins_with_its_own_values(tmp_path: Path) -> None:
    """The start-up script compares SYS_AUTOSTART with the one that was saved."""
    start = Start(tmp_path)
    start.parameters.set("MPC_XY_CRUISE", 6.5)
    start.parameters.set("CAL_ACC0_XOFF", 0.1)
    start.storage.close()
    assert Start(tmp_path).parameters["MPC_XY_CRUISE"] == 6.5
    other = Start(tmp_path, airframe=10016)
    assert other.parameters.changed() == {**SET, "SYS_AUTOSTART": 10016, "CAL_ACC0_XOFF": pytest.approx(0.1)}
    other.run(1.0)
    back = Start(tmp_path)
    assert back.parameters["MPC_XY_CRUISE"] == back.parameters.default("MPC_XY_CRUISE")


def test_files_of_earlier_emulators_count(tmp_path: Path) -> None:
    """They had SYS_AUTOSTART, and nothing else that a first start sets."""
    (tmp_path / storage.PARAMETERS).write_bytes(parameter_file.encode({"MPC_XY_CRUISE": 6.5, "SYS_AUTOSTART": 10044}))
    assert Start(tmp_path).parameters.changed() == {**SET, "MPC_XY_CRUISE": 6.5}


def test_what_was_reset_stays_so_until_the_airframe_is_another(tmp_path: Path) -> None:
    """Calibration that is forgotten is missing at the next start as well; with SYS_AUTOSTART forgotten, all is set."""
    start = Start(tmp_path)
    start.parameters.reset(lambda name: name.startswith("CAL_"))
    start.storage.close()
    again = Start(tmp_path)
    assert (again.parameters["CAL_ACC0_ID"], again.parameters["SYS_AUTOSTART"]) == (0, 10044)
    again.parameters.reset()
    assert (again.parameters["SYS_AUTOSTART"], again.parameters["MAV_SYS_ID"]) == (0, 1)
    again.storage.close()
    assert Start(tmp_path).parameters.changed() == SET


def test_what_a_start_set_is_there_after_a_load(tmp_path: Path) -> None:
    start = Start(tmp_path)
    start.run(1.0)
    start.parameters.set("MPC_XY_CRUISE", 6.5)
    assert start.storage.load()
    assert start.parameters.changed() == SET


def test_a_full_disk_is_told_once_and_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    start = Start(tmp_path)
    tries = []

    def fail(path: Path, data: bytes) -> None:
        tries.append(start.now_us)
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(storage, "write", fail)
        start.parameters.set("MPC_XY_CRUISE", 6.5)
        start.run(20.0)
    assert start.said == ["Parameters not saved: No space left on device"]
    assert len(tries) == 4
    start.parameters.set("MPC_XY_CRUISE", 6.6)
    start.run(3.0)
    assert start.parameters.unsaved == set()


def test_without_a_folder_nothing_is_kept_and_nothing_told() -> None:
    start = Start(None)
    start.parameters.set("MPC_XY_CRUISE", 6.5)
    start.run(1.0)
    assert (start.said, start.parameters.unsaved) == ([], set())


def test_an_autopilot_keeps_parameters(tmp_path: Path) -> None:
    airframe: dict[str, Any] = {"MAV_TYPE": 13, "CA_ROTOR_COUNT": 6}
    autopilot = Autopilot(airframe, 4, tmp_path)
    autopilot.parameters.set("MPC_XY_CRUISE", 6.5)
    autopilot.close()
    again = Autopilot(airframe, 4, tmp_path)
    assert (again.parameters["MPC_XY_CRUISE"], again.parameters["MAV_SYS_ID"]) == (6.5, 5)
