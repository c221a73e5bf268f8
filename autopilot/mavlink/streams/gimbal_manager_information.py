"""GIMBAL_MANAGER_INFORMATION: what the gimbal can, as its device says (PX4: streams/GIMBAL_MANAGER_INFORMATION.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION
NO_ROLL: Final = (0.0, 0.0)
"""Stops of the roll: PX4 does not take them from the device (handle_message_gimbal_device_information)."""


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before the manager found a gimbal, the last then. Angles in rad; flags as the device has them."""
    information = context.topics.gimbal_manager_information
    if not information.timestamp:
        return None
    stops = (*NO_ROLL, information.pitch_min, information.pitch_max, information.yaw_min, information.yaw_max)
    return (information.timestamp // 1000, information.cap_flags, *stops, information.gimbal_device_id)
