"""GLOBAL_POSITION_INT: position, velocity and heading (PX4: streams/GLOBAL_POSITION_INT.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
CDEG = math.degrees(100.0)


def stamp(now_us: int, context: Context) -> int:
    """Each message has a new position."""
    return context.topics.vehicle_global_position.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """1e-7 deg, mm, cm/s, cdeg; altitude relative to home, or to the sea while there is no home.

    It goes on while the position is only reckoned, as LOCAL_POSITION_NED does.
    """
    topics = context.topics
    position = topics.vehicle_global_position
    local = topics.vehicle_local_position
    if not math.isfinite(position.lat):
        return None
    home = topics.home_position
    relative_m = position.alt - home.alt if home.valid else position.alt
    heading = local.heading
    if heading < 0.0:
        heading += 2.0 * math.pi
    return (
        position.timestamp // 1000,
        truncated(position.lat * 1e7),
        truncated(position.lon * 1e7),
        truncated(position.alt * 1000.0),
        truncated(relative_m * 1000.0),
        truncated(local.vx * 100.0),
        truncated(local.vy * 100.0),
        truncated(local.vz * 100.0),
        min(truncated(heading * CDEG), 35999),
    )
