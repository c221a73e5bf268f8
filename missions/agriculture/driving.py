"""What the UGV's companion does to drive: scripts (`companion/onboard.py`) from a `Way` to a standstill."""

import math
from collections.abc import Generator

from sitl_emu.gcs.mission import MissionItem
from sitl_emu.gcs.set_mode import set_mode
from sitl_emu.missions.agriculture.jobs import NAV_WAYPOINT
from sitl_emu.missions.agriculture.report import FRAME_GLOBAL_RELATIVE_ALT
from sitl_emu.missions.agriculture.ways import Course, LatLon, Way
from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK
from sitl_emu.missions.companion.onboard import Onboard, Script

ARM_TRIES = 10
BRAKING_S = 5.0


def here(onboard: Onboard) -> Generator[None, None, LatLon]:
    """Where the vehicle is, once it is known."""
    while (place := onboard.telemetry.place) is None:
        yield
    return place.lat_deg, place.lon_deg


def heading(onboard: Onboard) -> Course:
    """The direction that the vehicle faces."""
    place = onboard.telemetry.place
    pose = onboard.telemetry.pose_at(place.time_us) if place is not None else None
    yaw = pose.yaw_rad if pose is not None else 0.0
    return math.cos(yaw), math.sin(yaw)


def set_out(onboard: Onboard, way: Way) -> Script:
    """Gives the autopilot a way as its mission, and starts it. Raises StepFailed."""
    onboard.yielding.expect(())
    waypoint = MissionItem(FRAME_GLOBAL_RELATIVE_ALT, NAV_WAYPOINT, param4=math.nan)
    items = [waypoint._replace(x=round(lat * 1e7), y=round(lon * 1e7)) for lat, lon in way.points]
    yield from steps.upload(onboard, items)
    yield from steps.command(onboard, set_mode(onboard.system_id, "mission"), "mission mode")
    onboard.telemetry.mission_reached = None
    yield from steps.arm(onboard, ARM_TRIES)
    onboard.yielding.expect({"mission"})
    onboard.note("way", f"{len(way.points)} waypoints", points=way.as_text)


def arrive(onboard: Onboard, way: Way, within_m: float, timeout_s: float) -> Script:
    """Until the vehicle stands at the way's end. Raises StepFailed."""
    return steps.until_standing(onboard, *way.points[-1], within_m, timeout_s, last_item=len(way.points) - 1)


def stop(onboard: Onboard) -> Script:
    """Stops where it is. Raises StepFailed."""
    onboard.yielding.expect(())
    yield from steps.command(onboard, set_mode(onboard.system_id, "hold"), "hold")
    yield from steps.pause(onboard, BRAKING_S, until=lambda: onboard.telemetry.speed_m_s < steps.STILL_M_S)


def park(onboard: Onboard) -> Script:
    """Holds and disarms, so that people may come near."""
    onboard.yielding.expect(())
    yield from onboard.do(AUTOPILOT_LINK, set_mode(onboard.system_id, "hold"))
    yield from steps.disarm(onboard)
