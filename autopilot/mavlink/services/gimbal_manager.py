"""Gimbal protocol v2, the autopilot's half: set-points of ground stations in, and what gimbal devices say.

https://mavlink.io/en/services/gimbal_v2.html. Whether a set-point is obeyed, the manager decides
(autopilot/payload/gimbal.py), whatever its target; commands come to it as all commands do. GIMBAL_MANAGER_SET_PITCHYAW
PX4 v1.18 does not know (mavlink_receiver.cpp), its command it does.
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import (
    NAN3,
    GimbalDeviceAttitudeStatus,
    GimbalDeviceInformation,
    GimbalManagerSetAttitude,
    Topics,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import quaternion

SET_ATTITUDE = mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_ATTITUDE
SET_MANUAL = mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_MANUAL_CONTROL
INFORMATION = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION
ATTITUDE_STATUS = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS


class GimbalManager:
    """Writer of gimbal_manager_set_attitude, gimbal_device_information and gimbal_device_attitude_status."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({SET_ATTITUDE, SET_MANUAL, INFORMATION, ATTITUDE_STATUS})
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep what it says."""
        message_id = message.get_msgId()
        if message_id == ATTITUDE_STATUS:
            w, x, y, z = message.q
            self._topics.gimbal_device_attitude_status = GimbalDeviceAttitudeStatus(now_us, message.flags, (w, x, y, z))
        elif message_id == INFORMATION:
            self._topics.gimbal_device_information = information(now_us, message)
        else:
            self._topics.gimbal_manager_set_attitude = set_attitude(now_us, message)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""


def information(now_us: int, message: Any) -> GimbalDeviceInformation:
    """Of a GIMBAL_DEVICE_INFORMATION, whoever's: the component that speaks, what it can, and its stops."""
    return GimbalDeviceInformation(
        now_us,
        message.get_srcComponent(),
        message.vendor_name,
        message.model_name,
        message.custom_name,
        message.firmware_version,
        message.hardware_version,
        message.uid,
        message.cap_flags,
        message.pitch_min,
        message.pitch_max,
        message.yaw_min,
        message.yaw_max,
    )


def set_attitude(now_us: int, message: Any) -> GimbalManagerSetAttitude:
    """Of one of the two messages that point a gimbal; angles and rates that are NaN are not wanted.

    Of manual control both angles or rates are wanted, or neither (InputMavlinkGimbalV2::_process_set_manual_control).
    """
    origin = (message.get_srcSystem(), message.get_srcComponent())
    if message.get_msgId() == SET_ATTITUDE:
        w, x, y, z = message.q
        rates = (message.angular_velocity_x, message.angular_velocity_y, message.angular_velocity_z)
        return GimbalManagerSetAttitude(now_us, *origin, message.flags, (w, x, y, z), rates)
    turns = math.isfinite(message.pitch_rate) and math.isfinite(message.yaw_rate)
    return GimbalManagerSetAttitude(
        now_us,
        *origin,
        message.flags,
        quaternion(0.0, message.pitch, message.yaw),
        (0.0, message.pitch_rate, message.yaw_rate) if turns else NAN3,
        True,
    )
