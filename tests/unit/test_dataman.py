"""Plans from one start to the next."""

from pathlib import Path

import pytest

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.storage.dataman import FENCE, MISSION, RALLY, Dataman, MissionItem, Plan

ITEMS = tuple(MissionItem(seq, 6, 16, 1, 0.0, 2.5, 0.0, float("inf"), 473977418, -85455939, 10.5) for seq in range(3))


def test_plans_and_progress_are_there_at_the_next_start(tmp_path: Path) -> None:
    dataman = Dataman(tmp_path)
    assert dataman.store(MISSION, Plan(ITEMS, 1234), 0)
    assert dataman.store(FENCE, Plan(ITEMS[:1], 0xFFFFFFFF), 0)
    dataman.current_seq = 2
    dataman.save_progress()
    again = Dataman(tmp_path)
    assert (again.mission, again.fence, again.rally) == (Plan(ITEMS, 1234), Plan(ITEMS[:1], 0xFFFFFFFF), Plan())
    assert again.current_seq == 2
    again.store(MISSION, Plan(), 0)
    assert Dataman(tmp_path).plans == {MISSION: Plan(), FENCE: Plan(ITEMS[:1], 0xFFFFFFFF), RALLY: Plan()}


def test_10000_items_are_kept(tmp_path: Path) -> None:
    items = tuple(ITEMS[0]._replace(seq=seq) for seq in range(10_000))
    assert Dataman(tmp_path).store(MISSION, Plan(items, 1), 0)
    assert Dataman(tmp_path).mission.items == items


@pytest.mark.parametrize("content", [b"", b"x", b"sitl-emu dataman 1\n\0\0\0\0", bytes(1000)])
def test_a_damaged_file_is_told_and_holds_nothing(tmp_path: Path, content: bytes) -> None:
    (tmp_path / storage.DATAMAN).write_bytes(content)
    said: list[tuple[Severity, str]] = []
    dataman = Dataman(tmp_path, lambda severity, text: said.append((severity, text)))
    assert dataman.plans == {MISSION: Plan(), FENCE: Plan(), RALLY: Plan()}
    assert said == [(Severity.CRITICAL, "Missions not loaded: dataman is damaged")]


def test_a_plan_that_cannot_be_written_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dataman = Dataman(tmp_path)
    dataman.store(MISSION, Plan(ITEMS, 1), 1)

    def fail(path: Path, data: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(storage, "write", fail)
    assert not dataman.store(MISSION, Plan(ITEMS[:1], 2), 0)
    assert (dataman.mission, dataman.current_seq) == (Plan(ITEMS, 1), 1)


def test_without_a_folder_plans_are_kept_in_memory() -> None:
    dataman = Dataman()
    assert dataman.store(RALLY, Plan(ITEMS, 5), 0)
    assert dataman.rally.opaque_id == 5
