"""LOCAL_POSITION_NED: position and velocity from the local origin (PX4: streams/LOCAL_POSITION_NED.hpp).

It goes on while the position is only reckoned after a loss of GPS, as it was seen to do on PX4 v1.18, and does not ask
whether the filter knows the globe: by vision or flow alone there is a place as well.
"""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED


def stamp(now_us: int, context: Context) -> int:
    """Each message has a new position."""
    return context.topics.vehicle_local_position.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Metres, m/s; nothing until the filter runs."""
    position = context.topics.vehicle_local_position
    if position.timestamp == 0:
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
