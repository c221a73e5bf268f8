"""GNSS_INTEGRITY: trust in the receiver (PX4: streams/GNSS_INTEGRITY.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_GNSS_INTEGRITY
UNKNOWN = 0
QUALITY_UNKNOWN = 255


def fields(now_us: int, context: Context) -> Fields | None:
    """The simulated receiver knows nothing of jamming or spoofing."""
    if context.topics.sensor_gps.timestamp == 0:
        return None
    return (0, 65535, 65535, 0, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, *(QUALITY_UNKNOWN,) * 4)
