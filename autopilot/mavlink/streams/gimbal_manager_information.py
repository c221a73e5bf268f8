"""GIMBAL_MANAGER_INFORMATION: what the gimbal can, as its device says (PX4: streams/GIMBAL_MANAGER_INFORMATION.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION
OF_MANAGER: Final = (
    mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_NEUTRAL
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_ROLL_LOCK
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_AXIS
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_LOCK
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_AXIS
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL
)
"""Capability flags of PX4's manager, whatever the device."""


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before a gimbal was found. Angles in rad."""
    device = context.topics.gimbal_device_information
    if not device.component:
        return None
    stops = (device.roll_min, device.roll_max, device.pitch_min, device.pitch_max, device.yaw_min, device.yaw_max)
    return (now_us // 1000, OF_MANAGER, *stops, device.component)
