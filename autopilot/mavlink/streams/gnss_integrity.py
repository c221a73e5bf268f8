"""GNSS_INTEGRITY: trust in the receiver (PX4: streams/GNSS_INTEGRITY.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GNSS_INTEGRITY
UNKNOWN: Final = 0
RAIM_UNKNOWN_CM: Final = 65535
QUALITY_UNKNOWN: Final = 255
RECEIVER: Final = 4
"""Lowest byte of the device_id of PX4's simulated receiver (bus type SIMULATION, bus 0)."""


def stamp(now_us: int, context: Context) -> int:
    """Once per fix."""
    return context.topics.sensor_gps.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """The simulated receiver knows nothing of jamming or spoofing."""
    if context.topics.sensor_gps.timestamp == 0:
        return None
    return (0, RAIM_UNKNOWN_CM, RAIM_UNKNOWN_CM, RECEIVER, *(UNKNOWN,) * 4, *(QUALITY_UNKNOWN,) * 4)
