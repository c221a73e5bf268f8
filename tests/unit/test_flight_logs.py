"""The flight logs of a run, found in its folder."""

import errno
from pathlib import Path

import pytest

from sitl_emu.run import flight_logs


def made(folder: Path, vehicle: str, *names: str) -> None:
    (folder / "rootfs" / vehicle / "log").mkdir(parents=True)
    for name in names:
        (folder / "rootfs" / vehicle / "log" / name).write_text(f"{vehicle} {name}")


def found(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.glob("*.ulg")}


def test_the_first_log_has_the_vehicles_name_and_later_ones_a_number(tmp_path: Path) -> None:
    made(tmp_path, "uas", "1.ulg", "2.ulg")
    flight_logs.show(tmp_path, ["uas"])
    assert found(tmp_path) == {"uas.ulg": "uas 1.ulg", "uas-2.ulg": "uas 2.ulg"}
    assert (tmp_path / "uas.ulg").is_symlink()


def test_where_a_file_system_has_no_links_logs_are_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    made(tmp_path, "uas", "1.ulg")
    monkeypatch.setattr(Path, "symlink_to", none)
    flight_logs.show(tmp_path, ["uas"])
    assert found(tmp_path) == {"uas.ulg": "uas 1.ulg"}
