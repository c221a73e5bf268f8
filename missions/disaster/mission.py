"""The disaster mission: what it brings, by name. Its parts are imported when they are needed."""

from pathlib import Path
from typing import Any

from sitl_emu.missions.companion.companion import Companion
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.mission import Mission, Program, Setting


def _responder(options: Options) -> Companion:
    from sitl_emu.missions.disaster.responder import Responder

    return Responder.from_options(options)


def _prepare(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    from sitl_emu.missions.disaster.plans import in_degrees

    if setting.calibration is None:
        raise ValueError("it looks at camera frames; give its vehicle a `camera`")
    return {"calibration": str(setting.calibration)} | in_degrees(options, setting)


MISSION = Mission(
    programs={"disaster": Program(_responder, _prepare)},
    scenarios=Path(__file__).with_name("scenarios"),
)
