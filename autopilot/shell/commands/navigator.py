"""navigator: the fence that is flown in, and aircraft to test traffic avoidance with (PX4: modules/navigator)."""

import math
from collections.abc import Sequence

from sitl_emu.autopilot.navigator.geofence import Area, Circle, Polygon
from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command
from sitl_emu.autopilot.topics import TransponderReport, queue_transponder_report
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import MapProjection


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`navigator status` or `fake_traffic`."""
    if list(arguments) == ["fake_traffic"]:
        return (yield from _fake_traffic(vehicle))
    if list(arguments) != ["status"]:
        return (yield from default_command("navigator", True, arguments))
    areas = vehicle.navigator.fence_areas
    polygons, circles = ([area for area in areas if isinstance(area, kind)] for kind in (Polygon, Circle))
    vertices = sum(area.vertex_count for area in areas if isinstance(area, Polygon))
    yield info("navigator", "Running")
    yield info(
        "navigator",
        f"Geofence: polygons: {_inclusions(polygons)}, {vertices} vertices; circles: {_inclusions(circles)}",
    )
    return SUCCESS


def _inclusions(areas: Sequence[Area]) -> str:
    inside = sum(area.inclusion for area in areas)
    return f"{inside} inclusion, {len(areas) - inside} exclusion"


def _fake_traffic(vehicle: Vehicle) -> Output:
    """All at once, as AdsbConflict::run_fake_traffic: more than the queue keeps, and than there may be conflicts."""
    topics = vehicle.topics
    place = topics.vehicle_global_position
    if not math.isfinite(place.lat + place.lon + place.alt):
        return SUCCESS
    here = MapProjection(place.lat, place.lon)
    for number, away_m in FAKE_TRAFFIC:
        lat, lon = here.reproject(away_m * math.cos(FAKE_DIRECTION_RAD), away_m * math.sin(FAKE_DIRECTION_RAD))
        report = TransponderReport(
            vehicle.now_us, 0, number, lat, lon, 0, place.alt, 0.0, FAKE_SPEED_M_S, FAKE_SPEED_M_S,
            f"LX{number:03}".encode(), mavlink.ADSB_EMITTER_TYPE_LIGHT, 2, FAKE_FLAGS, 6667, retranslate=False,
        )  # fmt: skip
        queue_transponder_report(topics, report)
    for icao_address in vehicle.navigator.traffic.conflicts:
        yield info("navigator", f"{icao_address} ")
    return SUCCESS


NEAR_M, FAR_M = 5.0, 5000.0
FAKE_DIRECTION_RAD = 1.0
FAKE_SPEED_M_S = 90_000.0
FAKE_FLAGS = 0x1F
"""All but the squawk is valid."""
FAKE_TRAFFIC = (
    *((number, NEAR_M) for number in (1, 2, 2, 2, 2, *range(3, 14))),
    *((number, FAR_M) for number in range(1, 5)),
    *((number, NEAR_M) for number in (13, 13, 14, 14, 15)),
)
"""Number and distance of each report."""
