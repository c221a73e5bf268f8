"""RC_CHANNELS: the sticks, as RC_CHANNELS_OVERRIDE set them (PX4: streams/RC_CHANNELS.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_RC_CHANNELS
UNUSED: Final = 65535
CHANNELS: Final = 18
FULL_STRENGTH: Final = 100
"""input_rc.rssi of every override (RSSI_MAX); with channels that are all released it is not told."""


def stamp(now_us: int, context: Context) -> int:
    """Once per received override."""
    return context.topics.input_rc.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Microseconds; nothing until somebody overrides channels: there is no receiver."""
    received = context.topics.input_rc
    channels = received.values
    if not received.timestamp:
        return None
    padding = (UNUSED,) * (CHANNELS - len(channels))
    return (received.timestamp // 1000, *channels, *padding, len(channels), FULL_STRENGTH if channels else 0)
