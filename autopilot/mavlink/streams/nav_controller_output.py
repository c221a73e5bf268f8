"""NAV_CONTROLLER_OUTPUT: a rover has a new waypoint (PX4: streams/NAV_CONTROLLER_OUTPUT.hpp).

A rover's position controller fills in its acceptance radius alone, which the message lacks; and as there is no TECS,
the altitude error is the height itself. The rest is 0, as PX4 v1.18 sends it on a rover.
"""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT


def stamp(now_us: int, context: Context) -> int:
    """Once per waypoint."""
    return context.topics.position_controller_status.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before the first waypoint, and nothing on a multicopter."""
    topics = context.topics
    if not topics.position_controller_status.timestamp:
        return None
    position = topics.vehicle_global_position
    altitude_error_m = -position.alt if position.valid else 0.0
    return 0.0, 0.0, altitude_error_m, 0.0, 0.0, 0, 0, 0
