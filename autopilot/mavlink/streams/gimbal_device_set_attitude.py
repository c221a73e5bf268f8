"""GIMBAL_DEVICE_SET_ATTITUDE: where the gimbal is to look (PX4: streams/GIMBAL_DEVICE_SET_ATTITUDE.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_SET_ATTITUDE


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing without a gimbal manager; else the last, new or not, to nobody (0) before a gimbal was found."""
    wanted = context.topics.gimbal_device_set_attitude
    if not wanted.timestamp:
        return None
    return (*wanted.q, *wanted.angular_velocity, wanted.flags, context.system_id, wanted.target_component)
