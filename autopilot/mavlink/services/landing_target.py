"""LANDING_TARGET and TARGET_RELATIVE: where a precision landing is to end (topics.landing_target_pose and
fiducial_marker_pos_report).

https://mavlink.io/en/services/landing_target.html. As PX4 v1.18: a position in MAV_FRAME_LOCAL_NED is taken as it is,
in another frame it is refused with a text. Nothing comes of angles (as an IR-LOCK camera gives them): the
landing_target_estimator, for which PX4 keeps them, is not in its SITL (boards/px4/sitl/default.px4board).
TARGET_RELATIVE (https://mavlink.io/en/messages/development.html#TARGET_RELATIVE) is a fiducial as its sensor sees it:
in the local frame, in one that travels with the vehicle, or in the sensor's, whose attitude it then tells. It is for
the vision_target_estimator; where VTE_EN is 0 it is landed on as it is
(MavlinkReceiver::handle_message_target_relative). The time that a place is told with counts once the clock that it is
of is known (timesync.py).
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.timesync import Timesync
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import FiducialMarkerPosReport, LandingTargetPose, Quaternion, Topics, Vector3
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import rotated, rotation

TARGET_RELATIVE = mavlink.MAVLINK_MSG_ID_TARGET_RELATIVE
LOCAL_NED, BODY_FRD, LOCAL_OFFSET_NED, OTHER = range(4)
"""TARGET_OBS_FRAME: from the local origin, from the vehicle along its axes or those of NED, from the sensor."""
FARTHEST_M = 1e6
LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)
SMALLEST_QUATERNION = 1.2e-7
"""FLT_EPSILON: a smaller one is not filled."""


class LandingTarget:
    """Writer of landing_target_pose and of fiducial_marker_pos_report."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_LANDING_TARGET, TARGET_RELATIVE})
    HAS_TIMER = False

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, timesync: Timesync) -> None:
        """Writes into `topics`; `timesync` knows others' clocks."""
        self._topics, self._parameters = topics, parameters
        self._say, self._timesync = say, timesync

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep the position."""
        seen_us = now_us
        if message.get_msgId() == TARGET_RELATIVE:
            seen_us = self._timesync.sync_stamp(now_us, link, message.timestamp)
            place = self._relative(seen_us, message)
        elif not message.position_valid:
            return
        elif message.frame == mavlink.MAV_FRAME_LOCAL_NED:
            seen_us = self._timesync.sync_stamp(now_us, link, message.time_usec)
            place = (message.x, message.y, message.z)
        else:
            place = None
            text = f"Landing target: coordinate frame {message.frame} unsupported\t"
            self._refuse(text, "mavlink_rcv_lnd_target_unsup_coord", message.frame)
        if place is not None and sum(map(abs, place)) < FARTHEST_M:
            self._topics.landing_target_pose = LandingTargetPose(seen_us, *place)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""

    def _refuse(self, text: str, event: str, argument: int) -> None:
        self._say(Severity.CRITICAL, text)
        self._say(Severity.ERROR, "", event, argument)

    def _relative(self, seen_us: int, message: Any) -> Vector3 | None:
        """Where to land by a TARGET_RELATIVE; None where nobody knows, and where it is refused or passed on."""
        frame, local = message.frame, self._topics.vehicle_local_position
        attitude = _told_attitude(message.q_sensor)
        if attitude is None and frame != OTHER:
            attitude = self._topics.vehicle_attitude.q if frame == BODY_FRD else LEVEL
        if frame not in (LOCAL_NED, BODY_FRD, LOCAL_OFFSET_NED, OTHER):
            text = f"target relative: coordinate frame {frame} unsupported.\t"
            self._refuse(text, "mavlink_rcv_target_rel_unsup_coord_frame", frame)
        elif message.type != mavlink.LANDING_TARGET_TYPE_VISION_FIDUCIAL:
            text = f"target relative: type {message.type} unsupported.\t"
            self._refuse(text, "mavlink_rcv_target_rel_unsup_type", message.type)
        elif attitude is None:
            text = f"target relative: coordinate frame {frame} unsupported when the q_sensor is not filled.\t"
            self._refuse(text, "mavlink_rcv_target_rel_q_sensor_not_filled", frame)
        elif self._parameters["VTE_EN"]:
            self._report(seen_us, message, attitude)
        elif frame == LOCAL_NED:
            return message.x, message.y, message.z
        elif local.xy_valid and local.z_valid:
            x, y, z = message.x, message.y, message.z
            if frame != LOCAL_OFFSET_NED:
                x, y, z = rotated(rotation(attitude), (x, y, z))
            return local.x + x, local.y + y, local.z + z
        return None

    def _report(self, seen_us: int, message: Any, attitude: Quaternion) -> None:
        """Pass on what a camera sees, from the vehicle."""
        x, y, z = message.x, message.y, message.z
        if message.frame == LOCAL_NED:
            local = self._topics.vehicle_local_position
            if not (local.xy_valid and local.z_valid):
                return
            x, y, z = x - local.x, y - local.y, z - local.z
        dx, dy, dz = message.pos_std
        report = FiducialMarkerPosReport(seen_us, (x, y, z), (dx * dx, dy * dy, dz * dz), attitude)
        self._topics.fiducial_marker_pos_report = report


def _told_attitude(q: Any) -> Quaternion | None:
    """A quaternion, made a unit; None where there is none."""
    length = math.hypot(*q)
    if not length > SMALLEST_QUATERNION:
        return None
    w, x, y, z = (part / length for part in q)
    return w, x, y, z
