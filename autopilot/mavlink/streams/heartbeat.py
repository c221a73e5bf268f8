"""HEARTBEAT: type, mode and state of the vehicle (PX4: streams/HEARTBEAT.hpp)."""

from autopilot.commander.custom_mode import base_mode_of, custom_mode_of
from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_HEARTBEAT
MAVLINK_VERSION = 3


def fields(now_us: int, context: Context) -> Fields:
    """Present mode and state."""
    topics = context.topics
    status = topics.vehicle_status
    offboard = topics.offboard_setpoint
    base_mode = base_mode_of(
        status.nav_state,
        armed=status.armed,
        traits=context.traits,
        offboard_attitude=offboard.trajectory is not None or offboard.attitude is not None,
    )
    return (
        custom_mode_of(status.nav_state),
        context.mav_type,
        mavlink.MAV_AUTOPILOT_PX4,
        base_mode,
        status.system_status,
        MAVLINK_VERSION,
    )
