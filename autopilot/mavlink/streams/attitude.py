"""ATTITUDE: Euler angles and body rates (PX4: streams/ATTITUDE.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ATTITUDE


def stamp(now_us: int, context: Context) -> int:
    """Every sample of the gyro brings an attitude (EKF2::PublishAttitude)."""
    return context.topics.vehicle_angular_velocity.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Radians, rad/s; FRD to NED."""
    attitude = context.topics.vehicle_attitude
    if not attitude.timestamp:
        return None
    roll, pitch, yaw = attitude.euler
    p, q, r = context.topics.vehicle_angular_velocity.xyz
    return (attitude.timestamp // 1000, roll, pitch, yaw, p, q, r)
