"""EXTENDED_SYS_STATE: on the ground, taking off, in the air, landing (PX4: streams/EXTENDED_SYS_STATE.hpp)."""

from sitl_emu.autopilot.constants import SetpointType
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE
LANDED_STATE_BY_SETPOINT: dict[int, int] = {
    SetpointType.TAKEOFF: mavlink.MAV_LANDED_STATE_TAKEOFF,
    SetpointType.LAND: mavlink.MAV_LANDED_STATE_LANDING,
}


def fields(now_us: int, context: Context) -> Fields:
    """MAV_VTOL_STATE (0: none) and MAV_LANDED_STATE."""
    topics = context.topics
    nav_state = topics.vehicle_status.nav_state
    if topics.vehicle_land_detected.landed:
        landed_state = mavlink.MAV_LANDED_STATE_ON_GROUND
    elif FLIGHT_MODES[nav_state].setpoint_tells_landed_state:
        setpoint_type = topics.position_setpoint_triplet.current.type
        landed_state = LANDED_STATE_BY_SETPOINT.get(setpoint_type, mavlink.MAV_LANDED_STATE_IN_AIR)
    else:
        landed_state = mavlink.MAV_LANDED_STATE_IN_AIR
    return (0, landed_state)
