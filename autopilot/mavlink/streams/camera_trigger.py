"""CAMERA_TRIGGER: an image was asked of the camera (PX4: streams/CAMERA_TRIGGER.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_CAMERA_TRIGGER


def stamp(now_us: int, context: Context) -> int:
    """Once per image."""
    return context.topics.camera_trigger.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before the first image."""
    trigger = context.topics.camera_trigger
    return (trigger.timestamp, trigger.seq) if trigger.timestamp else None
