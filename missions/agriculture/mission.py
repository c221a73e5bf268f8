"""The agriculture mission: what it brings, by name. Its parts are imported when they are needed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from missions.companion.companion import Companion
from missions.companion.options import Options
from missions.mission import Figures, Mission, Program, Row, Setting
from missions.reporting import Page
from missions.scoring import MissionScore, RunRecord


def _scout(options: Options) -> Companion:
    from missions.agriculture.scout import Scout

    return Scout.from_options(options)


def _inspect(options: Options) -> Companion:
    from missions.agriculture.inspect import Inspect

    return Inspect.from_options(options)


def _prepare_scout(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    from missions.agriculture.plans import written

    return written(_with_camera(options, setting), setting)


def _with_camera(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    if setting.calibration is None:
        raise ValueError("it looks at camera frames; give its vehicle a `camera`")
    return {"calibration": str(setting.calibration)} | options


def _score(record: RunRecord) -> MissionScore:
    from missions.agriculture.score import score

    return score(record)


def _page(figures: Figures) -> Page:
    from missions.agriculture.page import page

    return page(figures)


def _evaluation(summaries: Sequence[Figures]) -> list[Row]:
    from missions.agriculture.evaluation import rows

    return rows(summaries)


MISSION = Mission(
    programs={
        "agriculture-scout": Program(_scout, _prepare_scout),
        "agriculture-inspect": Program(_inspect, _with_camera),
    },
    scenarios=Path(__file__).with_name("scenarios"),
    score=_score,
    page=_page,
    evaluation=_evaluation,
)
