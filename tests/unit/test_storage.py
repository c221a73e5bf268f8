"""The folder of an instance: made, tried and forgotten."""

import errno
import os
from pathlib import Path

import pytest

from sitl_emu.autopilot.storage import storage
from sitl_emu.run import state
from sitl_emu.run.trouble import Trouble


def test_a_folder_is_made_as_px4_lays_it_out(tmp_path: Path) -> None:
    root = tmp_path / "a" / "iris-0"
    storage.prepare(root)
    assert sorted(path.name for path in root.iterdir()) == ["eeprom", "log"]


def test_fresh_forgets_parameters_and_missions_and_keeps_logs_and_the_users_files(tmp_path: Path) -> None:
    storage.prepare(tmp_path)
    for name in ("parameters.bson", "parameters_backup.bson", "dataman", "eeprom/calibration", "log/1.ulg", "mine.txt"):
        (tmp_path / name).write_text("x")
    storage.prepare(tmp_path)
    assert (tmp_path / "parameters.bson").exists()
    storage.prepare(tmp_path, fresh=True)
    left = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*"))
    assert left == ["eeprom", "log", "log/1.ulg", "mine.txt"]


def test_a_file_in_the_place_of_the_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "rover-3").touch()
    with pytest.raises(storage.StorageError, match=r"rover-3: can't keep files there: File exists"):
        storage.prepare(tmp_path / "rover-3")


def test_a_full_disk_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(**_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("tempfile.TemporaryFile", full)
    with pytest.raises(storage.StorageError, match=f"{tmp_path}: can't keep files there: No space left on device"):
        storage.prepare(tmp_path)


def test_the_state_folder_is_where_xdg_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "states"))
    assert state.default_folder() == tmp_path / "states" / "sitl-emu"
    monkeypatch.setenv("XDG_STATE_HOME", "relative")
    assert state.default_folder() == tmp_path / ".local" / "state" / "sitl-emu"


def test_a_vehicle_whose_folder_cannot_be_made_is_told_with_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "state").touch()
    with pytest.raises(Trouble, match="Not a directory; name another folder with --state"):
        state.prepare(tmp_path / "state", "iris", 0, fresh=False)
