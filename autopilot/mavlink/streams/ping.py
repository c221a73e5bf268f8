"""PING: a question to everybody on a link (PX4: streams/PING.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_PING
PER_LINK: Final = True


def fields(now_us: int, context: Context, link: Link) -> Fields:
    """Counts up per link; target 0/0 is a request."""
    sequence = link.ping_sequence
    link.ping_sequence += 1
    return (now_us, sequence, 0, 0)
