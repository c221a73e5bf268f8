"""Areas that follow the world: `area: world` becomes that world's outline, and metres become degrees.

`{corners_m: [[north, east], …], holes_m: […]}` counts from the world's origin. The mission reads degrees alone, as a
user's own area on a real flight.
"""

from collections.abc import Mapping
from typing import Any

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.mission import Setting


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
