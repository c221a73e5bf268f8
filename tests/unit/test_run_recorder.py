"""What a run writes down of the truth."""

import csv
from pathlib import Path

from sitl_emu.run.recorder import LOOSE, RunRecorder
from sitl_emu.world.description import Box, Loose
from sitl_emu.world.obstacles import LoosePose

LEVEL = (1.0, 0.0, 0.0, 0.0)


def crate(name: str) -> Loose:
    return Loose(name, 0.0, 0.0, mass_kg=1.0, box=Box((1.0, 1.0, 1.0)))


def test_loose_bodies_are_written_down_when_they_move(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, [], lambda _: None)
    still, fallen = LoosePose(crate("a, still"), (1.0, 2.0, 0.0), LEVEL), crate("b")
    for step, down in enumerate((-3.0, -2.0, -0.5, -0.5, -0.5)):
        recorder.loose(step * 20_000, [still, LoosePose(fallen, (0.0, 0.0, down), LEVEL)])
    recorder.close()
    with (tmp_path / LOOSE).open() as file:
        rows = list(csv.DictReader(file))
    told = [(row["time_s"], row["name"], float(row["down_m"])) for row in rows]
    assert told == [("0.00", "a, still", 0.0), ("0.00", "b", -3.0), ("0.02", "b", -2.0), ("0.04", "b", -0.5)]


def test_without_loose_bodies_there_is_no_such_file(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, [], lambda _: None)
    recorder.loose(0, [])
    recorder.close()
    assert not (tmp_path / LOOSE).exists()
