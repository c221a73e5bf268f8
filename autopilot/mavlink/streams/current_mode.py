"""CURRENT_MODE: mode flown and mode asked for (PX4: streams/CURRENT_MODE.hpp)."""

from sitl_emu.autopilot.commander.custom_mode import custom_mode_of
from sitl_emu.autopilot.mavlink.available_modes import standard_mode_of
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_CURRENT_MODE


def stamp(now_us: int, context: Context) -> int:
    """When vehicle_status was published: twice a second, and at once when the mode changes."""
    return context.topics.vehicle_status.timestamp


def fields(now_us: int, context: Context) -> Fields:
    """Custom modes and the MAV_STANDARD_MODE of the one that is shown."""
    status = context.topics.vehicle_status
    shown = status.nav_state_display
    intended = custom_mode_of(status.nav_state_user_intention)
    return (custom_mode_of(shown), intended, standard_mode_of(shown, context.traits))
