"""GIMBAL_DEVICE_INFORMATION: what a gimbal device said of itself (PX4: streams/GIMBAL_DEVICE_INFORMATION.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION
NO_ROLL: Final = (0.0, 0.0)
"""Stops of the roll: PX4 does not take them from the device (handle_message_gimbal_device_information)."""
NO_CUSTOM_CAPABILITIES: Final = 0
NO_MORE_CAPABILITIES: Final = 0


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before one was heard, whether or not there is a gimbal manager. Angles in rad."""
    device = context.topics.gimbal_device_information
    if not device.timestamp:
        return None
    stops = (*NO_ROLL, device.pitch_min, device.pitch_max, device.yaw_min, device.yaw_max)
    versions = (device.firmware_version, device.hardware_version)
    names = [name.encode("ascii", "replace") for name in (device.vendor_name, device.model_name, device.custom_name)]
    capabilities = (device.cap_flags, NO_CUSTOM_CAPABILITIES)
    end = (device.gimbal_device_id, NO_MORE_CAPABILITIES)
    return (device.uid, device.timestamp // 1000, *versions, *stops, *capabilities, *names, *end)
