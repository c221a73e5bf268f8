"""TIMESYNC: answers other clocks with ours (https://mavlink.io/en/services/timesync.html)."""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink


class Timesync:
    """Echoes ts1 and adds our time, in ns. Offsets of others are not estimated: nothing here needs them."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_TIMESYNC})
    HAS_TIMER = False

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """tc1 0 is a question; the answer names who asked (MavlinkTimesync::handle_message)."""
        if message.tc1 == 0:
            asker = (message.get_srcSystem(), message.get_srcComponent())
            link.send_fields(mavlink.MAVLINK_MSG_ID_TIMESYNC, now_us * 1000, message.ts1, *asker)

    def on_time(self, now_us: int) -> None:
        """Nothing to do: the stream of the same name asks."""
