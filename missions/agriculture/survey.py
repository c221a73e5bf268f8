"""The scouting flight over a field: a Survey of its outline as a QGroundControl plan.

The field is a rectangle that begins at its south-west corner, where the UAS stands. Lines run north-south, along the
crop rows. At 15 m a camera of 90° sees 30 m across: with lines 13 m apart every place is seen from two lines.
"""

from typing import Any

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.gcs.plan_file import survey_plan

ALTITUDE_M = 15.0
SPACING_M = 13.0
SPEED_M_S = 5.0
FENCE_MARGIN_M = 30.0
RALLY_ALTITUDE_M = 15.0


def field_plan(
    lat_deg: float,
    lon_deg: float,
    alt_amsl_m: float,
    north_m: float,
    east_m: float,
    altitude_m: float = ALTITUDE_M,
    spacing_m: float = SPACING_M,
    speed_m_s: float = SPEED_M_S,
) -> dict[str, Any]:
    """Content of a plan for a field of `north_m` x `east_m` with its south-west corner, home, at the given place."""

    def corners(margin_m: float) -> list[tuple[float, float]]:
        low, north, east = -margin_m, north_m + margin_m, east_m + margin_m
        return [from_metres(n, e, lat_deg, lon_deg) for n, e in ((low, low), (north, low), (north, east), (low, east))]

    rally = (*from_metres(0.0, -4.0, lat_deg, lon_deg), RALLY_ALTITUDE_M)
    return survey_plan(
        (lat_deg, lon_deg, alt_amsl_m),
        corners(0.0),
        altitude_m,
        spacing_m,
        speed_m_s,
        fence=corners(FENCE_MARGIN_M),
        rally=[rally],
    )
