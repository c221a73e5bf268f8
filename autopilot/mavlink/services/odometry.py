"""ODOMETRY, VISION_POSITION_ESTIMATE, VISION_SPEED_ESTIMATE, ATT_POS_MOCAP: poses from outside.

https://mavlink.io/en/messages/common.html#ODOMETRY. As PX4 v1.18 takes them: the first three, unless they say that they
come from motion capture, are for the filter (topics.vehicle_visual_odometry; EKF2_EV_CTRL), ENU and FLU frames turned
to NED and FRD. ATT_POS_MOCAP, and ODOMETRY of a motion capture, go where EKF2 does not look.
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import (
    FRAME_BODY_FRD,
    FRAME_FRD,
    FRAME_NED,
    FRAME_UNKNOWN,
    NAN3,
    Quaternion,
    Topics,
    Vector3,
    VehicleOdometry,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import product, quaternion

ODOMETRY = mavlink.MAVLINK_MSG_ID_ODOMETRY
VISION_POSITION = mavlink.MAVLINK_MSG_ID_VISION_POSITION_ESTIMATE
VISION_SPEED = mavlink.MAVLINK_MSG_ID_VISION_SPEED_ESTIMATE
NO_ATTITUDE: Quaternion = (math.nan, math.nan, math.nan, math.nan)
UPPER_DIAGONAL = (0, 6, 11, 15, 18, 20)
"""Places of x, y, z, roll, pitch, yaw in the upper half of a 6 x 6 matrix, by rows."""
HALF = math.sqrt(0.5)
ENU_TO_NED: Quaternion = (0.0, HALF, HALF, 0.0)
"""A quaternion's frame, from ENU and FLU to NED and FRD: this one before, FLU_TO_FRD after it."""
FLU_TO_FRD: Quaternion = (0.0, 1.0, 0.0, 0.0)


class Odometry:
    """Writer of vehicle_visual_odometry."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset(
        {ODOMETRY, VISION_POSITION, VISION_SPEED, mavlink.MAVLINK_MSG_ID_ATT_POS_MOCAP}
    )
    HAS_TIMER = False

    def __init__(self, topics: Topics, system_id: int) -> None:
        """Writes into `topics`."""
        self._topics = topics
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep what the filter may use."""
        message_id = message.get_msgId()
        sample: VehicleOdometry | None = None
        if message_id == VISION_POSITION:
            sample = of_vision_position(now_us, message)
        elif message_id == VISION_SPEED:
            sample = of_vision_speed(now_us, message)
        elif message_id == ODOMETRY and message.estimator_type != mavlink.MAV_ESTIMATOR_TYPE_MOCAP:
            sample = of_odometry(now_us, message)
        if sample is not None:
            self._topics.vehicle_visual_odometry = sample

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""


def of_vision_position(now_us: int, message: Any) -> VehicleOdometry:
    """A pose in NED."""
    position_variance, orientation_variance = _variances(message.covariance)
    return VehicleOdometry(
        now_us,
        FRAME_NED,
        (message.x, message.y, message.z),
        quaternion(message.roll, message.pitch, message.yaw),
        FRAME_UNKNOWN,
        NAN3,
        position_variance,
        orientation_variance,
        NAN3,
        message.reset_counter,
    )


def of_vision_speed(now_us: int, message: Any) -> VehicleOdometry:
    """A velocity in NED."""
    told = message.covariance
    spread = (told[0], told[4], told[8]) if math.isfinite(told[0]) else NAN3
    return VehicleOdometry(
        now_us,
        FRAME_UNKNOWN,
        NAN3,
        NO_ATTITUDE,
        FRAME_NED,
        (message.x, message.y, message.z),
        NAN3,
        NAN3,
        spread,
        message.reset_counter,
    )


def of_odometry(now_us: int, message: Any) -> VehicleOdometry | None:
    """Pose and velocity in the frames that the message names; None where PX4 knows neither."""
    x, y, z = message.x, message.y, message.z
    w, qx, qy, qz = message.q
    q: Quaternion = (w, qx, qy, qz)
    frame = message.frame_id
    if frame == mavlink.MAV_FRAME_LOCAL_NED:
        pose_frame, position = FRAME_NED, (x, y, z)
    elif frame == mavlink.MAV_FRAME_LOCAL_ENU:
        pose_frame, position, q = FRAME_NED, (y, x, -z), product(product(ENU_TO_NED, q), FLU_TO_FRD)
    elif frame == mavlink.MAV_FRAME_LOCAL_FRD:
        pose_frame, position = FRAME_FRD, (x, y, z)
    elif frame == mavlink.MAV_FRAME_LOCAL_FLU:
        pose_frame, position, q = FRAME_FRD, (x, -y, -z), product(product(FLU_TO_FRD, q), FLU_TO_FRD)
    else:
        pose_frame, position, q = FRAME_UNKNOWN, NAN3, NO_ATTITUDE
    velocity_frame, velocity = _velocity(message)
    if pose_frame == velocity_frame == FRAME_UNKNOWN:
        return None
    position_variance, orientation_variance = _variances(message.pose_covariance)
    return VehicleOdometry(
        now_us,
        pose_frame,
        position,
        q,
        velocity_frame,
        velocity,
        position_variance,
        orientation_variance,
        _variances(message.velocity_covariance)[0],
        message.reset_counter,
        message.quality,
    )


def _velocity(message: Any) -> tuple[int, Vector3]:
    vx, vy, vz = message.vx, message.vy, message.vz
    frame = message.child_frame_id
    if frame == mavlink.MAV_FRAME_LOCAL_NED:
        return FRAME_NED, (vx, vy, vz)
    if frame == mavlink.MAV_FRAME_LOCAL_ENU:
        return FRAME_NED, (vy, vx, -vz)
    if frame == mavlink.MAV_FRAME_LOCAL_FRD:
        return FRAME_FRD, (vx, vy, vz)
    if frame == mavlink.MAV_FRAME_LOCAL_FLU:
        return FRAME_FRD, (vx, -vy, -vz)
    if frame in (mavlink.MAV_FRAME_BODY_FRD, mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED):
        return FRAME_BODY_FRD, (vx, vy, vz)
    return FRAME_UNKNOWN, NAN3


def _variances(covariance: Any) -> tuple[Vector3, Vector3]:
    """Of position and orientation, from the upper half of a 6 x 6 matrix; NaN where its first number says so."""
    if not math.isfinite(covariance[0]):
        return NAN3, NAN3
    x, y, z, roll, pitch, yaw = (covariance[place] for place in UPPER_DIAGONAL)
    return (x, y, z), (roll, pitch, yaw)
