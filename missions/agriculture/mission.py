"""The agriculture mission: what it brings, by name. Its parts are imported when they are needed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sitl_emu.missions.companion.companion import Companion
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.mission import Figures, Mission, Program, Row, Setting
from sitl_emu.missions.reporting import Page
from sitl_emu.missions.scoring import MissionScore, RunRecord


def _scout(options: Options) -> Companion:
    from sitl_emu.missions.agriculture.scout import Scout

    return Scout.from_options(options)


def _inspect(options: Options) -> Companion:
    from sitl_emu.missions.agriculture.inspect import Inspect

    return Inspect.from_options(options)


def _prepare_scout(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    from sitl_emu.missions.agriculture.plans import written

    return written(_with_camera(options, setting), setting)


def _prepare_inspect(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    from sitl_emu.missions.agriculture.field_map import with_world

    return with_world(_with_camera(options, setting), setting)


def _with_camera(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    if setting.calibration is None:
        raise ValueError("it looks at camera frames; give its vehicle a `camera`")
    return {"calibration": str(setting.calibration)} | options


def _score(record: RunRecord) -> MissionScore:
    from sitl_emu.missions.agriculture.score import score

    return score(record)


def _page(figures: Figures) -> Page:
    from sitl_emu.missions.agriculture.page import page

    return page(figures)


def _evaluation(summaries: Sequence[Figures]) -> list[Row]:
    from sitl_emu.missions.agriculture.evaluation import rows

    return rows(summaries)


MISSION = Mission(
    programs={
        "agriculture-scout": Program(_scout, _prepare_scout),
        "agriculture-inspect": Program(_inspect, _prepare_inspect),
    },
    scenarios=Path(__file__).with_name("scenarios"),
    score=_score,
    page=_page,
    evaluation=_evaluation,
)
