"""Where a camera is and where it looks: what the autopilot, and the gimbal that carries it, last told.

GLOBAL_POSITION_INT and ATTITUDE_QUATERNION come when the autopilot is asked for them, GIMBAL_DEVICE_ATTITUDE_STATUS by
itself, SYSTEM_TIME once.
"""

import math
from typing import Any, NamedTuple

from sitl_emu.core import attitude
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import Quaternion

POSITION = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
ATTITUDE = mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION
SYSTEM_TIME = mavlink.MAVLINK_MSG_ID_SYSTEM_TIME
GIMBAL_ATTITUDE = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS
MOUNT_PITCH_RAD = {"nadir": math.radians(-90.0), "mast": math.radians(-60.0), "gimbal": 0.0}
"""Camera axes against the body, as `sitl_emu/world/lens.py` mounts them; on a gimbal, until that was heard."""


class Geotag(NamedTuple):
    """Where an image was taken; degrees 1e-7, mm, quaternion of the camera (w, x, y, z)."""

    lat: int = 0
    lon: int = 0
    alt: int = 0
    relative_alt: int = 0
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)


class CameraPose:
    """The pose of one camera, fixed to the body by `mount` unless a gimbal tells where it looks."""

    def __init__(self, mount: str) -> None:
        self._mount = mount
        self.boot_unix_us = 0
        """When the vehicle started, 0 while it is not known."""
        self._position: Any = None
        self._attitude: Any = None
        self._gimbal_q: Quaternion | None = None
        self._gimbal_yaw_locked = False

    def forget(self) -> None:
        """Position and attitude are asked for anew."""
        self._position = self._attitude = None

    def on_message(self, message: Any) -> None:
        """One of the four."""
        message_id = message.get_msgId()
        if message_id == SYSTEM_TIME:
            self.boot_unix_us = message.time_unix_usec - message.time_boot_ms * 1000
        elif message_id == POSITION:
            self._position = message
        elif message_id == ATTITUDE:
            self._attitude = message
        elif message_id == GIMBAL_ATTITUDE:
            w, x, y, z = message.q
            self._gimbal_q = (w, x, y, z)
            self._gimbal_yaw_locked = bool(message.flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)

    def geotag(self) -> Geotag:
        """As far as it is known."""
        where = self._position
        if where is None:
            return Geotag(q=self._orientation())
        return Geotag(where.lat, where.lon, where.alt, where.relative_alt, self._orientation())

    def _orientation(self) -> Quaternion:
        """Of the camera's axes (forward, right, down) in NED."""
        how = self._attitude
        body = (1.0, 0.0, 0.0, 0.0) if how is None else (how.q1, how.q2, how.q3, how.q4)
        if self._gimbal_q is not None:
            # The gimbal tells roll and pitch against the horizon, and yaw against north or the vehicle's heading
            heading = 0.0 if self._gimbal_yaw_locked else attitude.euler(body)[2]
            return attitude.product(attitude.quaternion(0.0, 0.0, heading), self._gimbal_q)
        return attitude.product(body, attitude.quaternion(0.0, MOUNT_PITCH_RAD[self._mount], 0.0))
