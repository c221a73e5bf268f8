"""LOCAL_POSITION_NED: position and velocity from the local origin (PX4: streams/LOCAL_POSITION_NED.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED


def fields(now_us: int, context: Context) -> Fields | None:
    """Metres, m/s; nothing until the estimate is valid in both axes."""
    position = context.topics.vehicle_local_position
    if not (position.xy_valid and position.v_xy_valid):
        return None
    return (
        position.timestamp // 1000,
        position.x,
        position.y,
        position.z,
        position.vx,
        position.vy,
        position.vz,
    )
