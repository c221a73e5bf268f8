"""PROTOCOL_VERSION: MAVLink 2 and what we accept (PX4: streams/PROTOCOL_VERSION.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION
VERSION: Final = 200
MIN_VERSION: Final = 100
MAX_VERSION: Final = 203
LIBRARY_HASH = (68, 119, 41, 72, 158, 31, 203, 249)
"""First bytes of the hash of the MAVLink library that PX4 v1.18 was built with."""


def fields(now_us: int, context: Context) -> Fields:
    """On request."""
    return (VERSION, MIN_VERSION, MAX_VERSION, *(0,) * 8, *LIBRARY_HASH)
