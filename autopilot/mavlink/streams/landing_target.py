"""LANDING_TARGET: where a precision landing is to end, from the vehicle (PX4: streams/LANDING_TARGET.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_LANDING_TARGET
POSITION_VALID: Final = 1


def stamp(now_us: int, context: Context) -> int:
    """Once per pose."""
    return context.topics.landing_target_pose.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Metres NED; nothing before a target was told. Angles and sizes are not known (0)."""
    target, local = context.topics.landing_target_pose, context.topics.vehicle_local_position
    if not target.timestamp:
        return None
    away = (target.x_abs - local.x, target.y_abs - local.y, target.z_abs - local.z)
    unknown = (0.0, 0.0, 0.0, 0.0, 0.0, 0)
    return (target.timestamp, *unknown, mavlink.MAV_FRAME_LOCAL_NED, *away, *(0.0,) * 4, 0, POSITION_VALID)
