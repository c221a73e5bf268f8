"""ATTITUDE_QUATERNION: attitude (w, x, y, z) and body rates (PX4: streams/ATTITUDE_QUATERNION.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION


def stamp(now_us: int, context: Context) -> int:
    """Every sample of the gyro brings an attitude (EKF2::PublishAttitude)."""
    return context.topics.vehicle_angular_velocity.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """FRD to NED; no offset for tailsitters (all zero)."""
    attitude = context.topics.vehicle_attitude
    if not attitude.timestamp:
        return None
    w, x, y, z = attitude.q
    p, q, r = context.topics.vehicle_angular_velocity.xyz
    return (attitude.timestamp // 1000, w, x, y, z, p, q, r, 0.0, 0.0, 0.0, 0.0)
