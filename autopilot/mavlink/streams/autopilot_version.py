"""AUTOPILOT_VERSION: capabilities and version (PX4: streams/AUTOPILOT_VERSION.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
CAPABILITIES: Final = 59647
"""MAV_PROTOCOL_CAPABILITY bits of PX4 v1.18."""
GIMBAL_MANAGER: int = mavlink.MAV_PROTOCOL_CAPABILITY_COMPONENT_IMPLEMENTS_GIMBAL_MANAGER
MANAGER_BY_MAVLINK: Final = 4
"""MNT_MODE_IN: gimbal protocol v2 comes in."""
FLIGHT_SW_VERSION: Final = 17957119
"""v1.18.0, release type 255 (official)."""
BOARD_VERSION: Final = 1
CUSTOM_VERSION: Final = bytes(3) + b"emula"
"""The vendor's version (patch, minor, major: none) and the first five bytes of PX4's git hash, which is a name here."""
OS_CUSTOM_VERSION = bytes(8)
"""PX4 knows no hash of an operating system but NuttX's."""
UID: Final = 0x5349544C_00000000
OS_SW_VERSION: Final = 0


def fields(now_us: int, context: Context) -> Fields:
    """On request; the uid is made from the system's number."""
    manages = int(context.parameters["MNT_MODE_IN"]) == MANAGER_BY_MAVLINK
    uid = UID + context.system_id
    uid2 = uid.to_bytes(18, "little")
    versions = (FLIGHT_SW_VERSION, FLIGHT_SW_VERSION, OS_SW_VERSION, BOARD_VERSION, 0, 0)
    capabilities = CAPABILITIES | GIMBAL_MANAGER if manages else CAPABILITIES
    return (capabilities, uid, *versions, *CUSTOM_VERSION, *CUSTOM_VERSION, *OS_CUSTOM_VERSION, *uid2)
