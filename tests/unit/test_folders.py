"""Folders that commands fill."""

from pathlib import Path

import pytest

from sitl_emu.run import run_command
from sitl_emu.run.trouble import Trouble


def test_runs_that_start_in_the_same_second_have_a_folder_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.strftime", lambda _: "20260101-120000")
    made = [run_command.make_folder(None, "corn").name for _ in range(3)]
    assert made == ["corn-20260101-120000", "corn-20260101-120000-2", "corn-20260101-120000-3"]


def test_where_runs_can_not_be_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("runs").touch()
    with pytest.raises(Trouble, match=r"runs/corn-.*: can't write there: Not a directory; name another folder"):
        run_command.make_folder(None, "corn")
