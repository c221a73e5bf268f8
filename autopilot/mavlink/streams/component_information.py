"""COMPONENT_INFORMATION: the older form of COMPONENT_METADATA (PX4: streams/COMPONENT_INFORMATION.hpp)."""

from sitl_emu.autopilot.mavlink.component_metadata import files
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_COMPONENT_INFORMATION


def fields(now_us: int, context: Context) -> Fields:
    """On request; no peripherals."""
    general = files.general()
    return (now_us // 1000, general.json_crc32, 0, files.uri(files.GENERAL).encode(), b"")
