"""POSITION_TARGET_LOCAL_NED: what the position controller tracks (PX4: streams/POSITION_TARGET_LOCAL_NED.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED
IGNORE_BITS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 1024, 2048)
"""POSITION_TARGET_TYPEMASK: position, velocity, acceleration, yaw, yaw rate; 512 (a force) is none of PX4's."""


def stamp(now_us: int, context: Context) -> int:
    """Once per setpoint: none comes from modes that do not control the position."""
    return context.topics.vehicle_local_position_setpoint.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """NED; what is not controlled is NaN, and its bit of the type mask is set."""
    setpoint = context.topics.vehicle_local_position_setpoint
    if setpoint.timestamp == 0:
        return None
    values = (
        setpoint.x,
        setpoint.y,
        setpoint.z,
        setpoint.vx,
        setpoint.vy,
        setpoint.vz,
        *setpoint.acceleration,
        setpoint.yaw,
        setpoint.yawspeed,
    )
    mask = 0
    for bit, value in zip(IGNORE_BITS, values, strict=True):
        if math.isnan(value) or math.isinf(value):
            mask |= bit
    return (setpoint.timestamp // 1000, *values, mask, mavlink.MAV_FRAME_LOCAL_NED)
