"""POSITION_TARGET_GLOBAL_INT: where an AUTO mode flies to (PX4: streams/POSITION_TARGET_GLOBAL_INT.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT
UNTOLD: Final = (0.0,) * 8


def fields(now_us: int, context: Context) -> Fields | None:
    """The triplet's current setpoint; nothing while there is none or the vehicle is not flying by it.

    The motion is 0 where nobody tells it, as on a rover.
    """
    topics = context.topics
    current = topics.position_setpoint_triplet.current
    if not topics.actuator_armed.armed or not current.valid or not math.isfinite(current.lat):
        return None
    setpoint = topics.vehicle_local_position_setpoint
    motion = (setpoint.vx, setpoint.vy, setpoint.vz, *setpoint.acceleration, setpoint.yaw, setpoint.yawspeed)
    return (
        now_us // 1000,
        truncated(current.lat * 1e7),
        truncated(current.lon * 1e7),
        current.alt,
        *(motion if setpoint.timestamp else UNTOLD),
        0,
        mavlink.MAV_FRAME_GLOBAL_INT,
    )
