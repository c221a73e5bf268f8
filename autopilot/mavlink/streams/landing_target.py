"""LANDING_TARGET: where a precision landing is to end, from the vehicle (PX4: streams/LANDING_TARGET.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_LANDING_TARGET


def stamp(now_us: int, context: Context) -> int:
    """Once per pose."""
    return context.topics.landing_target_pose.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Metres NED, which only the vision target estimator knows; nothing before a target was told. No angles (0)."""
    target = context.topics.landing_target_pose
    if not target.timestamp:
        return None
    away = (target.x_rel, target.y_rel, target.z_rel)
    unknown = (0.0, 0.0, 0.0, 0.0, 0.0, 0)
    return (target.timestamp, *unknown, mavlink.MAV_FRAME_LOCAL_NED, *away, *(0.0,) * 4, 0, int(target.rel_pos_valid))
