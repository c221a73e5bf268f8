"""Flight plans that follow the world: a companion's option `plan: field` becomes a plan of that field's outline.

Several scouts share a field by strips: `plan: field 2/3` is the second of three from the west. The plan is written as a
QGroundControl file, and the mission reads it as it would read a user's own.
"""

import re
from pathlib import Path
from typing import Any

from gcs.geodesy import from_metres
from gcs.plan_file import write_plan
from missions.agriculture.survey import field_plan
from sitl_emu.run.worlds import World

FIELD = re.compile(r"field(?: (\d+)/(\d+))?")


def written(options: dict[str, Any], world: World, path: Path) -> dict[str, Any]:
    """The options, their `plan: field` replaced by a file written at `path`.

    Raises ValueError if the world has no field, or no such strip.
    """
    plan = options.get("plan")
    wanted = FIELD.fullmatch(plan) if isinstance(plan, str) else None
    if wanted is None:
        return options
    if world.field is None:
        raise ValueError(f"plan: {plan!r}: world {world.kind} has no field; give a .plan file")
    strip, strips = (int(number) for number in wanted.groups("1"))
    if not 1 <= strip <= strips:
        raise ValueError(f"plan: {plan!r}: allowed: 'field', or a strip of it, 'field K/N' with K from 1 to N")
    north_m, width_m = world.field.size_m[0], world.field.size_m[1] / strips
    corner = from_metres(0.0, (strip - 1) * width_m, world.home.lat_deg, world.home.lon_deg)
    write_plan(path, field_plan(*corner, world.home.alt_amsl_m, north_m, width_m))
    return {**options, "plan": str(path)}
