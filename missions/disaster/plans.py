"""What follows the world in a simulated run: the area, and which disaster is looked for.

`area: world` becomes that world's outline, and metres become degrees.
`{corners_m: [[north, east], …], holes_m: […]}` counts from the world's origin. The mission reads degrees alone, as a
user's own area on a real flight.
"""

from collections.abc import Mapping
from typing import Any

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.mission import Setting

SOUGHT = {"urban_flood": "water_body", "debris_field": "debris_field", "wildfire_perimeter": "fire_region"}
"""By the kind of the world: who sends the aircraft knows whether it is a flood, an earthquake or a fire. A network that
looks for all three takes grey flat roofs for ruins."""


def briefed(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    """The options, with the selection for this kind of world where they have none."""
    sought = SOUGHT.get(setting.world)
    return options if sought is None else {"selection": {sought: 1.0}} | options


def in_degrees(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    """The options, their `area` in degrees. Raises ValueError if the world has no outline, or an area can't be."""
    area = options.get("area", "world")
    if area == "world":
        if not setting.outline_m:
            raise ValueError(f"option area: 'world': world {setting.world} has no outline; give corners_m or corners")
        area = {"corners_m": [list(corner) for corner in setting.outline_m]}
    if not isinstance(area, Mapping) or "corners_m" not in area:
        return options
    if set(area) - {"corners_m", "holes_m"}:
        raise ValueError(f"option area: {area!r}; allowed: corners_m and holes_m together, or corners and holes")
    lat0_deg, lon0_deg, _ = setting.home

    def ring(corners: Any) -> list[list[float]]:
        return [[*from_metres(float(north), float(east), lat0_deg, lon0_deg)] for north, east in corners]

    try:
        made = {"corners": ring(area["corners_m"]), "holes": [ring(hole) for hole in area.get("holes_m", ())]}
    except (TypeError, ValueError):
        raise ValueError(f"option area: {area!r}; allowed: {{corners_m: [[north, east], …]}} in metres") from None
    return {**options, "area": made}
