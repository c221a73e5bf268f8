"""GIMBAL_MANAGER_INFORMATION: what the gimbal can, as its device says (PX4: streams/GIMBAL_MANAGER_INFORMATION.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION
NO_ROLL: Final = (0.0, 0.0)
"""Stops of the roll: PX4 does not take them from the device (handle_message_gimbal_device_information)."""


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before a gimbal was found. Angles in rad; flags as the device has them (input_mavlink.cpp)."""
    device = context.topics.gimbal_device_information
    if not device.component:
        return None
    stops = (*NO_ROLL, device.pitch_min, device.pitch_max, device.yaw_min, device.yaw_max)
    return (now_us // 1000, device.cap_flags, *stops, device.component)
