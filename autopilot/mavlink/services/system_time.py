"""SYSTEM_TIME from others: PX4 takes the date from it when it has none; ours is given, so it is only read."""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink


class SystemTime:
    """Known to be heard, and without effect: simulated time must not depend on who is connected."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_SYSTEM_TIME})
    HAS_TIMER = False

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Nothing changes."""

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
