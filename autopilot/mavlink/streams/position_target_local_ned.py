"""POSITION_TARGET_LOCAL_NED: what the position controller tracks (PX4: streams/POSITION_TARGET_LOCAL_NED.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED


def fields(now_us: int, context: Context) -> Fields | None:
    """NED; NaN in every axis that is not controlled. PX4 leaves the type mask 0."""
    setpoint = context.topics.vehicle_local_position_setpoint
    if setpoint.timestamp == 0 or context.is_rover:
        return None
    ax, ay, az = setpoint.acceleration
    return (
        setpoint.timestamp // 1000,
        setpoint.x,
        setpoint.y,
        setpoint.z,
        setpoint.vx,
        setpoint.vy,
        setpoint.vz,
        ax,
        ay,
        az,
        setpoint.yaw,
        setpoint.yawspeed,
        0,
        mavlink.MAV_FRAME_LOCAL_NED,
    )
