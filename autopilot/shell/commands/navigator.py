"""navigator: the fence that is flown in (PX4: modules/navigator)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from autopilot.shell.command import SUCCESS, Output, info
from autopilot.shell.commands.module import default_command
from sitl_emu.core import dialect as mavlink

if TYPE_CHECKING:
    from autopilot.autopilot import Autopilot


def main(autopilot: "Autopilot", arguments: Sequence[str]) -> Output:
    """`navigator status`."""
    if list(arguments) != ["status"]:
        return (yield from default_command("navigator", True, arguments))
    areas = dict.fromkeys(KINDS, 0.0)
    vertices = 0
    for item in autopilot.dataman.fence.items:
        corners = int(item.param1) if item.command in POLYGONS else 0
        vertices += 1 if corners else 0
        areas[item.command] = areas.get(item.command, 0.0) + (1.0 / corners if corners else 1.0)
    counts = [round(areas[kind]) for kind in KINDS]
    yield info("navigator", "Running")
    yield info(
        "navigator",
        f"Geofence: {counts[0]} inclusion, {counts[1]} exclusion polygons, "
        f"{counts[2]} inclusion, {counts[3]} exclusion circles, {vertices} total vertices",
    )
    return SUCCESS


POLYGONS = (
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
)
"""Each vertex says how many its polygon has."""
KINDS = (*POLYGONS, mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION)
