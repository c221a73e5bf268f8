"""The disaster mission: what it brings, by name. Its parts are imported when they are needed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sitl_emu.missions.companion.companion import Companion
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.mission import Figures, Mission, Program, Row, Setting
from sitl_emu.missions.reporting import Page
from sitl_emu.missions.scoring import MissionScore, RunRecord


def _responder(options: Options) -> Companion:
    from sitl_emu.missions.disaster.responder import Responder

    return Responder.from_options(options)


def _prepare(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    from sitl_emu.missions.disaster.plans import briefed, in_degrees

    if setting.calibration is None:
        raise ValueError("it looks at camera frames; give its vehicle a `camera`")
    kept: dict[str, Any] = {
        "calibration": str(setting.calibration),
        "terrain_map": str(setting.folder / f"{setting.vehicle}-terrain.tif"),
    }
    options = in_degrees(briefed(options, setting), setting)
    if len(setting.systems) > 1:
        from sitl_emu.missions.companion.swarm.key import for_a_run

        kept |= {"members": " ".join(map(str, setting.systems)), "datum_amsl_m": setting.home[2]}
        options = for_a_run(options, setting.seed)
    return kept | options


def _score(record: RunRecord) -> MissionScore:
    from sitl_emu.missions.disaster.score import score

    return score(record)


def _page(figures: Figures) -> Page:
    from sitl_emu.missions.disaster.page import page

    return page(figures)


def _evaluation(summaries: Sequence[Figures]) -> list[Row]:
    from sitl_emu.missions.disaster.evaluation import rows

    return rows(summaries)


MISSION = Mission(
    programs={"disaster": Program(_responder, _prepare)},
    scenarios=Path(__file__).with_name("scenarios"),
    score=_score,
    page=_page,
    evaluation=_evaluation,
)
