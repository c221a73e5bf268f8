"""COMPONENT_METADATA: where a ground station finds what our parameters and events mean (PX4's stream of that name)."""

from sitl_emu.autopilot.mavlink.component_metadata import files
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA


def fields(now_us: int, context: Context) -> Fields:
    """On request; the file is served by FTP."""
    general = files.general()
    return (now_us // 1000, general.json_crc32, files.uri(files.GENERAL).encode())
