"""EXTENDED_SYS_STATE: on the ground, taking off, in the air, landing (PX4: streams/EXTENDED_SYS_STATE.hpp)."""

from autopilot.constants import NavState
from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE


def fields(now_us: int, context: Context) -> Fields:
    """MAV_VTOL_STATE (0: none) and MAV_LANDED_STATE."""
    topics = context.topics
    nav_state = topics.vehicle_status.nav_state
    if topics.vehicle_land_detected.landed:
        landed_state = mavlink.MAV_LANDED_STATE_ON_GROUND
    elif nav_state == NavState.AUTO_TAKEOFF:
        landed_state = mavlink.MAV_LANDED_STATE_TAKEOFF
    elif nav_state == NavState.AUTO_LAND:
        landed_state = mavlink.MAV_LANDED_STATE_LANDING
    else:
        landed_state = mavlink.MAV_LANDED_STATE_IN_AIR
    return (0, landed_state)
