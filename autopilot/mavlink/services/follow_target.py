"""FOLLOW_TARGET: where the thing is that AUTO_FOLLOW_TARGET follows (topics.follow_target).

https://mavlink.io/en/messages/common.html#FOLLOW_TARGET. As PX4 takes it: from anybody, position and velocity alone.
"""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import FollowTarget as FollowTargetSample
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink


class FollowTarget:
    """Writer of topics.follow_target."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_FOLLOW_TARGET})
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Kept as it is told; the mode looks at it (FollowTargetEstimator)."""
        vx, vy, vz = message.vel
        lat, lon = message.lat * 1e-7, message.lon * 1e-7
        self._topics.follow_target = FollowTargetSample(now_us, lat, lon, message.alt, (vx, vy, vz))

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
