"""RC_CHANNELS_OVERRIDE: channels as if from a receiver; shown in RC_CHANNELS.

The sticks themselves are not flown by them: PX4 does that with COM_RC_IN_MODE 0 or 2 and a calibrated RC only.
"""

from typing import Any

from autopilot.mavlink.context import Context
from autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink

CHANNELS = 18
UNUSED = 65535


class RcOverride:
    """Writer of context.rc_channels."""

    MESSAGES = frozenset({mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE})
    HAS_TIMER = False

    def __init__(self, context: Context, system_id: int) -> None:
        """Writes into `context`."""
        self._context = context
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Channels up to the last that is set."""
        if message.target_system not in (0, self._system_id) or message.target_component not in (0, 1):
            return
        channels = [getattr(message, f"chan{number}_raw", 0) for number in range(1, CHANNELS + 1)]
        while channels and channels[-1] in (0, UNUSED):
            channels.pop()
        self._context.rc_channels = tuple(channels)
        self._context.rc_channels_us = now_us

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
