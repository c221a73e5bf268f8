"""GIMBAL_MANAGER_STATUS: who is in control of the gimbal (PX4: streams/GIMBAL_MANAGER_STATUS.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS
NO_SECONDARY = (0, 0)


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before a gimbal spoke; then the last, new or not."""
    status = context.topics.gimbal_manager_status
    if not status.timestamp:
        return None
    primary = (status.primary_control_sysid, status.primary_control_compid)
    return (status.timestamp // 1000, status.flags, status.gimbal_device_id, *primary, *NO_SECONDARY)
