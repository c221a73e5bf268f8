"""POSITION_TARGET_GLOBAL_INT: where an AUTO mode flies to (PX4: streams/POSITION_TARGET_GLOBAL_INT.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded

ID = mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT


def fields(now_us: int, context: Context) -> Fields | None:
    """The triplet's current setpoint; nothing while there is none or the vehicle is not flying by it."""
    topics = context.topics
    current = topics.position_setpoint_triplet.current
    if not topics.actuator_armed.armed or not current.valid or not math.isfinite(current.lat):
        return None
    setpoint = topics.vehicle_local_position_setpoint
    ax, ay, az = setpoint.acceleration
    return (
        now_us // 1000,
        rounded(current.lat * 1e7),
        rounded(current.lon * 1e7),
        current.alt,
        setpoint.vx,
        setpoint.vy,
        setpoint.vz,
        ax,
        ay,
        az,
        setpoint.yaw,
        setpoint.yawspeed,
        0,
        mavlink.MAV_FRAME_GLOBAL_INT,
    )
