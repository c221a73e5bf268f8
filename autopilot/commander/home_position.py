"""Where home is: set at the first good position, again at arming and takeoff, and by DO_SET_HOME.

PX4's HomePosition (src/modules/commander/HomePosition.cpp, v1.18). COM_HOME_EN 0 leaves home unset. A home that
somebody gave stays, until somebody asks for the vehicle's own place; so does home while a mission is flown. On the
ground a home that was set by itself follows the vehicle when it has been moved further than its position may be wrong.
"""

import math
from typing import Final

from sitl_emu.autopilot.topics import HomePosition, Topics
from sitl_emu.core.geodesy import MapProjection, distance_m

MOVED_AT_LEAST_M: Final = 1.0


def at_vehicle(now_us: int, topics: Topics) -> HomePosition | None:
    """Home where the vehicle is; None without a valid position."""
    position, local = topics.vehicle_global_position, topics.vehicle_local_position
    if not (position.valid and local.xy_valid and local.z_valid):
        return None
    return HomePosition(
        now_us,
        True,
        position.lat,
        position.lon,
        position.alt,
        local.x,
        local.y,
        local.z,
        local.heading,
        False,
        topics.home_position.update_count + 1,
        *topics.vehicle_attitude.euler[:2],
    )


def at_place(
    now_us: int, topics: Topics, lat_deg: float, lon_deg: float, alt_m: float, yaw_rad: float
) -> HomePosition | None:
    """Home at a place that somebody gave; None without a reference for the local frame."""
    local = topics.vehicle_local_position
    if not all(map(math.isfinite, (lat_deg, lon_deg, alt_m, local.ref_lat, local.ref_lon, local.ref_alt))):
        return None
    x, y = MapProjection(local.ref_lat, local.ref_lon).project(lat_deg, lon_deg)
    count = topics.home_position.update_count + 1
    return HomePosition(
        now_us,
        True,
        lat_deg,
        lon_deg,
        alt_m,
        x,
        y,
        local.ref_alt - alt_m,
        yaw_rad,
        manual_home=True,
        update_count=count,
    )


def in_local_frame(topics: Topics) -> HomePosition:
    """The same home, x, y and z as the local frame has it now."""
    home = topics.home_position
    moved = at_place(home.timestamp, topics, home.lat, home.lon, home.alt, home.yaw) if home.valid else None
    return home if moved is None else home._replace(x=moved.x, y=moved.y, z=moved.z)


def moved_away(topics: Topics) -> bool:
    """The vehicle is further from home than both may be wrong."""
    home, position = topics.home_position, topics.vehicle_global_position
    if not position.valid:
        return False
    error_m = max(MOVED_AT_LEAST_M, 2.0 * position.eph if position.eph == position.eph else MOVED_AT_LEAST_M)
    height_error_m = max(MOVED_AT_LEAST_M, 2.0 * position.epv if position.epv == position.epv else MOVED_AT_LEAST_M)
    return (
        distance_m(home.lat, home.lon, position.lat, position.lon) > error_m
        or abs(position.alt - home.alt) > height_error_m
    )
