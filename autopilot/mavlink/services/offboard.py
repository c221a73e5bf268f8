"""Offboard setpoints: SET_POSITION_TARGET_LOCAL_NED, _GLOBAL_INT and SET_ATTITUDE_TARGET into topics.offboard_setpoint.

As PX4's mavlink_receiver.cpp: an axis is controlled when its bit in the type mask is clear; frames LOCAL_NED, BODY_NED,
LOCAL_OFFSET_NED of positions, GLOBAL_INT, GLOBAL_RELATIVE_ALT_INT and GLOBAL_TERRAIN_ALT_INT (as above home) of places;
force setpoints are refused (ignored).
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.service import finite_or_nan, is_for
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    OffboardSetpoint,
    Topics,
    TrajectorySetpoint,
    Vector3,
    VehicleAttitudeSetpoint,
    VehicleRatesSetpoint,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import geodesy

FORCE = 0x200
YAW_IGNORE = 0x400
YAW_RATE_IGNORE = 0x800
"""POSITION_TARGET_TYPEMASK; bits 0..8 are x, y, z, vx, vy, vz, ax, ay, az."""
ATTITUDE_IGNORE = 0x80
ROLL_OR_PITCH_RATE_IGNORE = 0x3
YAW_RATE_OF_BODY_IGNORE = 0x4
THRUST_BODY_SET = 0x20
THROTTLE_IGNORE = 0x40
"""ATTITUDE_TARGET_TYPEMASK."""


class Offboard:
    """Writer of topics.offboard_setpoint."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
            mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET,
        }
    )
    HAS_TIMER = False

    def __init__(self, topics: Topics, system_id: int) -> None:
        """Writes into `topics`."""
        self._topics = topics
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Setpoints for others, in unknown frames or of forces change nothing."""
        if not is_for(message, self._system_id, broadcast=True):
            return
        message_id = message.get_msgId()
        if message_id == mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET:
            setpoint = attitude_setpoint(now_us, message, self._topics.vehicle_angular_velocity.xyz)
        elif message.type_mask & FORCE:
            return
        elif message_id == mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED:
            setpoint = self._local(now_us, message)
        else:
            setpoint = self._global(now_us, message)
        if setpoint is not None:
            self._topics.offboard_setpoint = setpoint

    def on_time(self, now_us: int) -> None:
        """Nothing to do: the commander notices when setpoints stop."""

    def _local(self, now_us: int, message: Any) -> OffboardSetpoint | None:
        position, velocity, acceleration = vectors(message, (message.x, message.y, message.z))
        frame = message.coordinate_frame
        here = self._topics.vehicle_local_position
        if frame == mavlink.MAV_FRAME_BODY_NED:
            velocity, acceleration = turned(velocity, here.heading), turned(acceleration, here.heading)
            position = NAN3
        elif frame == mavlink.MAV_FRAME_LOCAL_OFFSET_NED:
            position = (position[0] + here.x, position[1] + here.y, position[2] + here.z)
        elif frame != mavlink.MAV_FRAME_LOCAL_NED:
            return None
        return trajectory(now_us, message, position, velocity, acceleration)

    def _global(self, now_us: int, message: Any) -> OffboardSetpoint | None:
        frame = message.coordinate_frame
        here, home = self._topics.vehicle_local_position, self._topics.home_position
        if not math.isfinite(here.ref_lat):
            return None
        if frame in (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT):
            altitude_m = message.alt
        elif frame in RELATIVE_FRAMES:
            altitude_m = message.alt + home.alt
        else:
            return None
        projection = geodesy.MapProjection(here.ref_lat, here.ref_lon)
        north, east = projection.project(message.lat_int * 1e-7, message.lon_int * 1e-7)
        place = (north, east, here.ref_alt - altitude_m)
        return trajectory(now_us, message, *vectors(message, place))


RELATIVE_FRAMES = frozenset(
    {
        mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT,
        mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT,
    }
)


def vectors(message: Any, place: Vector3) -> tuple[Vector3, Vector3, Vector3]:
    """Position, velocity, acceleration with NaN where the type mask ignores an axis."""
    mask = message.type_mask
    values = (*place, message.vx, message.vy, message.vz, message.afx, message.afy, message.afz)
    x, y, z, vx, vy, vz, ax, ay, az = (
        NAN if mask >> bit & 1 else finite_or_nan(value) for bit, value in enumerate(values)
    )
    return (x, y, z), (vx, vy, vz), (ax, ay, az)


def turned(vector: Vector3, heading: float) -> Vector3:
    """A vector of the heading's frame in NED; if one horizontal axis is free, both are."""
    forward, right, down = vector
    cosine, sine = math.cos(heading), math.sin(heading)
    return (cosine * forward - sine * right, sine * forward + cosine * right, down)


def trajectory(
    now_us: int, message: Any, position: Vector3, velocity: Vector3, acceleration: Vector3
) -> OffboardSetpoint:
    """The setpoint with the message's yaw."""
    mask = message.type_mask
    yaw = NAN if mask & YAW_IGNORE else finite_or_nan(message.yaw)
    yawspeed = NAN if mask & YAW_RATE_IGNORE else finite_or_nan(message.yaw_rate)
    return OffboardSetpoint(now_us, TrajectorySetpoint(now_us, position, velocity, acceleration, yaw, yawspeed))


def attitude_setpoint(now_us: int, message: Any, present: Vector3) -> OffboardSetpoint | None:
    """Attitude if it is not ignored, else rates, with thrust 0..1 along the body's up, or along all its axes.

    What is not finite counts as 0; a yaw rate that is ignored is the `present` one. Nothing comes of an attitude
    without a direction, of rates without roll or pitch, and of either without thrust.
    """
    mask = message.type_mask
    if mask & THRUST_BODY_SET:
        told = message.thrust_body
    elif not mask & THROTTLE_IGNORE:
        told = (0.0, 0.0, -message.thrust)
    else:
        return None
    x, y, z = (max(-1.0, min(1.0, along)) if math.isfinite(along) else 0.0 for along in told)
    thrust_body = (x, y, z)
    roll_rate, pitch_rate, yaw_rate = (
        rate if math.isfinite(rate) else 0.0
        for rate in (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    )
    if not mask & ATTITUDE_IGNORE:
        length = math.hypot(*message.q)
        if not (math.isfinite(length) and length > 0.0):
            return None
        w, x, y, z = (part / length for part in message.q)
        turn = 0.0 if mask & YAW_RATE_OF_BODY_IGNORE else yaw_rate
        return OffboardSetpoint(now_us, attitude=VehicleAttitudeSetpoint(now_us, (w, x, y, z), turn, thrust_body))
    if mask & ROLL_OR_PITCH_RATE_IGNORE:
        return None
    rates = (roll_rate, pitch_rate, present[2] if mask & YAW_RATE_OF_BODY_IGNORE else yaw_rate)
    return OffboardSetpoint(now_us, rates=VehicleRatesSetpoint(now_us, rates, thrust_body))
