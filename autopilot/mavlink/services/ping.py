"""PING: answers a broadcast ping with its sender as target (https://mavlink.io/en/services/ping.html)."""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink


class Ping:
    """Only a ping to 0/0 is a question; one with a target is an answer."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_PING})
    HAS_TIMER = False

    def __init__(self, system_id: int) -> None:
        """`system_id` is ours: our own pings, come back by a detour, are not answered."""
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Echo time and number."""
        if message.target_system == 0 and message.target_component == 0 and message.get_srcSystem() != self._system_id:
            sender = (message.get_srcSystem(), message.get_srcComponent())
            link.send_fields(mavlink.MAVLINK_MSG_ID_PING, message.time_usec, message.seq, *sender)

    def on_time(self, now_us: int) -> None:
        """Nothing to do: the stream of the same name asks."""
