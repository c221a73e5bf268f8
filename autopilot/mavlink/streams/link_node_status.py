"""LINK_NODE_STATUS: traffic of a link (PX4: streams/LINK_NODE_STATUS.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_LINK_NODE_STATUS
PER_LINK: Final = True


def fields(now_us: int, context: Context, link: Link) -> Fields:
    """Rates are of the last second, B/s; how full the buffers are is not told (0). The time is in µs, as from PX4."""
    sent, received = link.bytes_per_s
    return (
        now_us,
        int(sent),
        int(received),
        link.messages_sent,
        link.messages_received,
        link.messages_lost,
        min(link.parse_errors, 65535),
        0,
        0,
        0,
        0,
    )
