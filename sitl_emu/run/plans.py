"""Flight plans that follow the world: a companion's option `plan: field` becomes a plan of that field's outline.

The plan is written as a QGroundControl file, and the mission reads it as it would read a user's own.
"""

from pathlib import Path
from typing import Any

from gcs.plan_file import write_plan
from missions.agriculture.survey import field_plan
from sitl_emu.run.worlds import World

FIELD = "field"


def written(options: dict[str, Any], world: World, path: Path) -> dict[str, Any]:
    """The options, their `plan: field` replaced by a file written at `path`. ValueError if the world has no field."""
    if options.get("plan") != FIELD:
        return options
    if world.field is None:
        raise ValueError(f"plan: {FIELD!r}: world {world.kind} has no field; give a .plan file")
    north_m, east_m = world.field.size_m
    home = world.home
    write_plan(path, field_plan(home.lat_deg, home.lon_deg, home.alt_amsl_m, north_m, east_m))
    return {**options, "plan": str(path)}
