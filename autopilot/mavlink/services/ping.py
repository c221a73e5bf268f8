"""PING: answers a broadcast ping with its sender as target, whoever that is, and times the answers to ours.

https://mavlink.io/en/services/ping.html; `mavlink status` tells how long answers take.
"""

from typing import Any, ClassVar, Final

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink

AUTOPILOT_COMPONENT: Final = 1


class Ping:
    """Only a ping to 0/0 is a question; one with a target is an answer."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_PING})
    HAS_TIMER = False

    def __init__(self, system_id: int) -> None:
        """`system_id` is ours: what is sent to it is an answer."""
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Echo time and number, or take note of an answer."""
        target = (message.target_system, message.target_component)
        if target == (self._system_id, AUTOPILOT_COMPONENT):
            link.pings.answered((now_us - message.time_usec) / 1000.0, message.seq)
        elif target == (0, 0):
            sender = (message.get_srcSystem(), message.get_srcComponent())
            link.send_fields(mavlink.MAVLINK_MSG_ID_PING, message.time_usec, message.seq, *sender)

    def on_time(self, now_us: int) -> None:
        """Nothing to do: the stream of the same name asks."""
