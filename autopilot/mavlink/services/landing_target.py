"""LANDING_TARGET: where a precision landing is to end (topics.landing_target_pose).

https://mavlink.io/en/services/landing_target.html. As PX4 v1.18: a position in MAV_FRAME_LOCAL_NED is taken as it is,
in another frame it is refused with a text; angles (as an IR-LOCK camera that looks down gives them) become a position
by the attitude and the height above ground. They are not filtered over time, as PX4's landing_target_estimator does.
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import LandingTargetPose, Topics
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import product

STEEPEST_RAD = math.radians(80.0)
"""A ray flatter than this does not tell where it meets the ground."""
FARTHEST_M = 1e6


class LandingTarget:
    """Writer of landing_target_pose."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_LANDING_TARGET})
    HAS_TIMER = False

    def __init__(self, topics: Topics, say: Say) -> None:
        """Writes into `topics`."""
        self._topics = topics
        self._say = say

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep the position."""
        if message.position_valid:
            if message.frame != mavlink.MAV_FRAME_LOCAL_NED:
                self._say(Severity.CRITICAL, f"Landing target: coordinate frame {message.frame} unsupported\t")
                self._say(Severity.ERROR, "", "mavlink_rcv_lnd_target_unsup_coord", message.frame)
            elif abs(message.x) + abs(message.y) + abs(message.z) < FARTHEST_M:
                self._topics.landing_target_pose = LandingTargetPose(now_us, message.x, message.y, message.z)
            return
        place = self._place(message.angle_x, message.angle_y)
        if place is not None:
            self._topics.landing_target_pose = LandingTargetPose(now_us, *place)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""

    def _place(self, angle_x: float, angle_y: float) -> tuple[float, float, float] | None:
        """Where the ray meets the ground; x is forward and y to the right of a camera that looks down."""
        local = self._topics.vehicle_local_position
        if not (abs(angle_x) < STEEPEST_RAD and abs(angle_y) < STEEPEST_RAD and local.dist_bottom_valid):
            return None
        w, x, y, z = self._topics.vehicle_attitude.q
        ray = (0.0, math.tan(angle_x), math.tan(angle_y), 1.0)
        _, north, east, down = product(product((w, x, y, z), ray), (w, -x, -y, -z))
        if down < math.cos(STEEPEST_RAD):
            return None
        length = local.dist_bottom / down
        return local.x + north * length, local.y + east * length, local.z + local.dist_bottom
