"""SET_VELOCITY_LIMITS: how fast the mode POSITION_SLOW may fly, by whoever works the camera (topics.velocity_limits).

https://mavlink.io/en/messages/development.html#SET_VELOCITY_LIMITS. As PX4 (handle_message_set_velocity_limits): from
anybody, whomever it is for; what is not finite is not limited by it.
"""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import Topics
from sitl_emu.autopilot.topics import VelocityLimits as Limits
from sitl_emu.core import dialect as mavlink


class VelocityLimits:
    """Writer of velocity_limits."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_SET_VELOCITY_LIMITS})
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep it, stamped with our time."""
        self._topics.velocity_limits = Limits(
            now_us, message.horizontal_speed_limit, message.vertical_speed_limit, message.yaw_rate_limit
        )

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
