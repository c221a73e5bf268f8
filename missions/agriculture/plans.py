"""Flight plans that follow the world: a scout's option `plan: field` becomes a plan of that field's outline.

Several scouts share a field by strips: `plan: field 2/3` is the second of three from the west. The plan is written as a
QGroundControl file, and the mission reads it as it would read a user's own.
"""

import re
from typing import Any

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.gcs.plan_file import write_plan
from sitl_emu.missions.agriculture.survey import field_plan
from sitl_emu.missions.mission import Setting

FIELD = re.compile(r"field(?: (\d+)/(\d+))?")


def written(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    """The options, their `plan: field` replaced by a file, VEHICLE.plan in the setting's folder.

    The field is taken as a rectangle from the world's origin to the north and east. Raises ValueError if the world has
    no outline, or the field no such strip.
    """
    plan = options.get("plan")
    wanted = FIELD.fullmatch(plan) if isinstance(plan, str) else None
    if wanted is None:
        return options
    if not setting.outline_m:
        raise ValueError(f"option plan: {plan!r}: world {setting.world} has no field; give a .plan file")
    strip, strips = (int(number) for number in wanted.groups("1"))
    if not 1 <= strip <= strips:
        raise ValueError(f"option plan: {plan!r}: allowed: 'field', or a strip of it, 'field K/N' with K from 1 to N")
    north_m, width_m = (max(corner[axis] for corner in setting.outline_m) for axis in (0, 1))
    width_m /= strips
    lat_deg, lon_deg, alt_amsl_m = setting.home
    corner = from_metres(0.0, (strip - 1) * width_m, lat_deg, lon_deg)
    path = setting.folder / f"{setting.vehicle}.plan"
    write_plan(path, field_plan(*corner, alt_amsl_m, north_m, width_m))
    return {**options, "plan": str(path)}
