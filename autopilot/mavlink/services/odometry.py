"""ODOMETRY, VISION_POSITION_ESTIMATE, ATT_POS_MOCAP: poses from outside.

https://mavlink.io/en/messages/common.html#ODOMETRY. As PX4 v1.18 takes them (mavlink_receiver.cpp): the first two,
unless they say that they come from motion capture, are for the filter (topics.vehicle_visual_odometry; EKF2_EV_CTRL).
Places and velocities of ENU and FLU frames are turned to NED and FRD, attitudes are taken as they come, whatever the
frame. ATT_POS_MOCAP, and ODOMETRY of a motion capture, go where EKF2 does not look, and the log does
(vehicle_mocap_odometry). VISION_SPEED_ESTIMATE it does not know. The time that they state counts once the clock that it
is of is known (timesync.py).
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.timesync import Timesync
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
from sitl_emu.core.attitude import quaternion

ODOMETRY = mavlink.MAVLINK_MSG_ID_ODOMETRY
VISION_POSITION = mavlink.MAVLINK_MSG_ID_VISION_POSITION_ESTIMATE
BODY_FRAMES = frozenset({mavlink.MAV_FRAME_BODY_FRD, mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED})
NO_ATTITUDE: Quaternion = (math.nan, math.nan, math.nan, math.nan)
UPPER_DIAGONAL = (0, 6, 11, 15, 18, 20)
"""Places of x, y, z, roll, pitch, yaw in the upper half of a 6 x 6 matrix, by rows."""
OF_VISION = frozenset(
    {
        mavlink.MAV_ESTIMATOR_TYPE_UNKNOWN,
        mavlink.MAV_ESTIMATOR_TYPE_NAIVE,
        mavlink.MAV_ESTIMATOR_TYPE_VISION,
        mavlink.MAV_ESTIMATOR_TYPE_VIO,
    }
)
"""Estimators whose ODOMETRY is for the filter; a naive one knows no variances."""


class Odometry:
    """Writer of vehicle_visual_odometry and vehicle_mocap_odometry."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({ODOMETRY, VISION_POSITION, mavlink.MAVLINK_MSG_ID_ATT_POS_MOCAP})
    HAS_TIMER = False

    def __init__(self, topics: Topics, say: Say, timesync: Timesync) -> None:
        """Writes into `topics`; `say` tells what is refused; `timesync` knows others' clocks."""
        self._topics, self._say, self._timesync = topics, say, timesync

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep what the filter may use."""
        if message.get_msgId() == VISION_POSITION:
            sample_us = self._timesync.sync_stamp(now_us, link, message.usec)
            self._topics.vehicle_visual_odometry = of_vision_position(sample_us, message)._replace(told_us=now_us)
        elif message.get_msgId() == ODOMETRY:
            kind = message.estimator_type
            if kind in OF_VISION:
                sample_us = self._timesync.sync_stamp(now_us, link, message.time_usec)
                self._topics.vehicle_visual_odometry = of_odometry(sample_us, message)._replace(told_us=now_us)
            elif kind == mavlink.MAV_ESTIMATOR_TYPE_MOCAP:
                sample_us = self._timesync.sync_stamp(now_us, link, message.time_usec)
                self._topics.vehicle_mocap_odometry = of_odometry(sample_us, message)._replace(told_us=now_us)
            else:
                self._say(Severity.CRITICAL, f"ODOMETRY: estimator_type {kind} unsupported\t")
                self._say(Severity.ERROR, "", "mavlink_rcv_odom_unsup_estimator_type", kind)
        else:
            sample_us = self._timesync.sync_stamp(now_us, link, message.time_usec)
            self._topics.vehicle_mocap_odometry = of_motion_capture(sample_us, message)._replace(told_us=now_us)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""


def of_vision_position(sample_us: int, message: Any) -> VehicleOdometry:
    """A pose in NED."""
    position_variance, orientation_variance = _variances(message.covariance)
    return VehicleOdometry(
        sample_us,
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


def of_motion_capture(sample_us: int, message: Any) -> VehicleOdometry:
    """ATT_POS_MOCAP: a pose in NED."""
    place, (w, x, y, z) = (message.x, message.y, message.z), message.q
    variances = _variances(message.covariance)
    return VehicleOdometry(sample_us, FRAME_NED, place, (w, x, y, z), FRAME_UNKNOWN, NAN3, *variances)


def of_odometry(sample_us: int, message: Any) -> VehicleOdometry:
    """Pose and velocity in the frames that the message names; what is not finite, or in another frame, is not told."""
    known = message.estimator_type != mavlink.MAV_ESTIMATOR_TYPE_NAIVE
    position_variance, orientation_variance = _variances(message.pose_covariance) if known else (NAN3, NAN3)
    velocity_variance = _variances(message.velocity_covariance)[0] if known else NAN3
    pose_frame, position = _local(message.frame_id, (message.x, message.y, message.z))
    velocity_frame, velocity = _local(message.child_frame_id, (message.vx, message.vy, message.vz))
    if message.child_frame_id in BODY_FRAMES:
        velocity = (message.vx, message.vy, message.vz)
        velocity_frame, velocity = (FRAME_BODY_FRD, velocity) if _is_finite(velocity) else (FRAME_UNKNOWN, NAN3)
    turning = (message.rollspeed, message.pitchspeed, message.yawspeed)
    w, x, y, z = message.q
    has_attitude = math.isfinite(w + x + y + z)
    return VehicleOdometry(
        sample_us,
        pose_frame,
        position,
        (w, x, y, z) if has_attitude else NO_ATTITUDE,
        velocity_frame,
        velocity,
        _of_frame(message.frame_id, position_variance) if pose_frame != FRAME_UNKNOWN else NAN3,
        orientation_variance if has_attitude else NAN3,
        _of_frame(message.child_frame_id, velocity_variance) if velocity_frame != FRAME_UNKNOWN else NAN3,
        message.reset_counter,
        message.quality,
        angular_velocity=turning if _is_finite(turning) else NAN3,
    )


def _is_finite(vector: Vector3) -> bool:
    return math.isfinite(sum(vector))


def _local(frame: int, vector: Vector3) -> tuple[int, Vector3]:
    """A vector of a local frame in NED or FRD."""
    x, y, z = vector
    if _is_finite(vector):
        if frame == mavlink.MAV_FRAME_LOCAL_NED:
            return FRAME_NED, (x, y, z)
        if frame == mavlink.MAV_FRAME_LOCAL_ENU:
            return FRAME_NED, (y, x, -z)
        if frame == mavlink.MAV_FRAME_LOCAL_FRD:
            return FRAME_FRD, (x, y, z)
        if frame == mavlink.MAV_FRAME_LOCAL_FLU:
            return FRAME_FRD, (x, -y, -z)
    return FRAME_UNKNOWN, NAN3


def _of_frame(frame: int, variances: Vector3) -> Vector3:
    """East and north change places in ENU."""
    x, y, z = variances
    return (y, x, z) if frame == mavlink.MAV_FRAME_LOCAL_ENU else variances


def _variances(covariance: Any) -> tuple[Vector3, Vector3]:
    """Of position and orientation, from the upper half of a 6 x 6 matrix."""
    x, y, z, roll, pitch, yaw = (covariance[place] for place in UPPER_DIAGONAL)
    return (x, y, z), (roll, pitch, yaw)
