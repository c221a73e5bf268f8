"""HEARTBEAT: type, mode and state of the vehicle (PX4: streams/HEARTBEAT.hpp)."""

from typing import Final

from sitl_emu.autopilot.commander.control_mode import control_mode
from sitl_emu.autopilot.commander.custom_mode import base_mode_of, custom_mode_of
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_HEARTBEAT
MAVLINK_VERSION: Final = 3


def fields(now_us: int, context: Context) -> Fields:
    """Present mode and state."""
    topics = context.topics
    status = topics.vehicle_status
    control = control_mode(status.nav_state, context.traits, topics.offboard_setpoint)
    return (
        custom_mode_of(status.nav_state_display),
        context.mav_type,
        mavlink.MAV_AUTOPILOT_PX4,
        base_mode_of(control, armed=status.armed),
        status.system_status,
        MAVLINK_VERSION,
    )
