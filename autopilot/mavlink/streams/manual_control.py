"""MANUAL_CONTROL: the sticks in use (PX4: streams/MANUAL_CONTROL.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL
EXTENSION_FIELDS = len(mavlink.MAVLink_manual_control_message.ordered_fieldnames) - 6


def fields(now_us: int, context: Context) -> Fields:
    """X pitch, y roll, r yaw in thousandths; z throttle 0..1000; the buttons as they came."""
    sticks = context.topics.manual_control_setpoint
    pitch, roll, yaw = (round(value * 1000.0) for value in (sticks.pitch, sticks.roll, sticks.yaw))
    throttle = round((sticks.throttle + 1.0) * 500.0)
    own_system = int(context.parameters["MAV_SYS_ID"])
    return (pitch, roll, throttle, yaw, sticks.buttons, own_system, *(0,) * EXTENSION_FIELDS)
