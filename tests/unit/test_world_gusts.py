"""The gusts of a world follow from the run's seed, whether the world is generated or a file."""

from pathlib import Path

import pytest

from sitl_emu.core.radio import RadioSettings
from sitl_emu.run import world_process, worlds
from sitl_emu.run.configs import WorldConfig
from sitl_emu.world import kinds
from sitl_emu.world.conditions import Changes, WindChange
from sitl_emu.world.wind import Wind
from sitl_emu.world.world import World

FILE = "name: own\n"
GUSTS = Changes(WindChange(0.0, 0.0, 2.0))


def gusts(wind: Wind) -> list[tuple[float, float, float]]:
    return [wind.at(time_us) for time_us in range(0, 10_000_000, 1_000_000)]


def config(folder: Path, kept: Path, seed: int) -> WorldConfig:
    return WorldConfig(
        folder=str(folder), start_us=0, seed=seed, world=str(kept), vehicles=(), radio=RadioSettings(), speed=None,
        time_limit_s=1.0, commands=(),
    )  # fmt: skip


def in_a_run(world: World, folder: Path, seed: int) -> Wind:
    """Of the world as the run's process has it from the run's folder."""
    return world_process.world_of(config(folder, worlds.keep(world, folder), seed)).wind


def test_a_files_gusts_follow_from_the_seed(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(FILE)
    drawn = [gusts(worlds.build(str(tmp_path / "own.yaml"), seed, {}, GUSTS).wind) for seed in (1, 2, 1)]
    assert drawn[0] == drawn[2] == gusts(Wind(gust_m_s=2.0, seed=1))
    assert drawn[0] != drawn[1]


def test_a_run_of_a_file_has_the_gusts_of_its_seed(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(FILE)
    (tmp_path / "run").mkdir()
    world = worlds.build(str(tmp_path / "own.yaml"), 3, {}, GUSTS)
    assert gusts(in_a_run(world, tmp_path / "run", 3)) == gusts(world.wind) == gusts(Wind(gust_m_s=2.0, seed=3))
    assert world.description.seed == 0, "it is painted as it was"


@pytest.mark.parametrize("kind", kinds.names())
def test_a_generated_worlds_gusts_are_those_of_the_seed_it_is_made_from(kind: str, tmp_path: Path) -> None:
    world = worlds.build(kind, 5, {}, GUSTS)
    assert world.description.seed == 5
    assert gusts(in_a_run(world, tmp_path, 5)) == gusts(world.wind) == gusts(Wind(gust_m_s=2.0, seed=5))
