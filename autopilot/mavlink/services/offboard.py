"""Offboard setpoints: SET_POSITION_TARGET_LOCAL_NED, _GLOBAL_INT and SET_ATTITUDE_TARGET into topics.offboard_setpoint.

As PX4's mavlink_receiver.cpp: an axis is controlled when its bit in the type mask is clear; frames are LOCAL_NED and
BODY_NED (velocity and acceleration), of places GLOBAL_INT, GLOBAL_RELATIVE_ALT_INT and GLOBAL_TERRAIN_ALT_INT.
MAV_FWDEXTSP 0 turns a deaf ear to all three.
"""

import math
from typing import Any, ClassVar, NamedTuple

from sitl_emu.autopilot.commander.control_mode import has_any
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.service import finite_or_nan, is_for
from sitl_emu.autopilot.parameters import Parameters
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
from sitl_emu.core.attitude import rotated, rotation

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
AHEAD: Vector3 = (1.0, 0.0, 0.0)
UP: Vector3 = (0.0, 0.0, -1.0)
THRUST_AXES = {
    mavlink.MAV_TYPE_FIXED_WING: AHEAD,
    mavlink.MAV_TYPE_GROUND_ROVER: AHEAD,
    mavlink.MAV_TYPE_SUBMARINE: AHEAD,
    mavlink.MAV_TYPE_QUADROTOR: UP,
    mavlink.MAV_TYPE_HEXAROTOR: UP,
    mavlink.MAV_TYPE_OCTOROTOR: UP,
    mavlink.MAV_TYPE_TRICOPTER: UP,
    mavlink.MAV_TYPE_HELICOPTER: UP,
    mavlink.MAV_TYPE_COAXIAL: UP,
}
"""Where the thrust of a MAV_TYPE goes; of others there is none (MavlinkReceiver::fill_thrust, which tells where that of
a VTOL goes by how it flies: there is none here)."""
NO_THRUST: Vector3 = (0.0, 0.0, 0.0)


Vectors = tuple[Vector3, Vector3, Vector3]
"""Position, velocity and acceleration, NED."""


class Refusals(NamedTuple):
    """Text and event for a frame, a force, and for what asks for nothing."""

    frame: tuple[str, str]
    force: tuple[str, str]
    invalid: tuple[str, str]


LOCAL = Refusals(
    ("SET_POSITION_TARGET_LOCAL_NED coordinate frame {} unsupported", "mavlink_rcv_sp_target_unsup_coord"),
    ("SET_POSITION_TARGET_LOCAL_NED force not supported", "mavlink_rcv_sp_target_unsup_force"),
    ("SET_POSITION_TARGET_LOCAL_NED invalid", "mavlink_rcv_sp_target_invalid"),
)
GLOBAL = Refusals(
    ("SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame {}", "mavlink_rcv_sp_target_gl_invalid_coord"),
    ("SET_POSITION_TARGET_GLOBAL_INT force not supported", "mavlink_rcv_sp_target_gl_unsup_force"),
    ("", ""),
)
"""Of a global one that asks for nothing PX4 tells nothing."""


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

    def __init__(self, topics: Topics, parameters: Parameters, system_id: int, say: Say) -> None:
        """Writes into `topics`; `say` tells what is refused."""
        self._topics, self._parameters, self._system_id, self._say = topics, parameters, system_id, say

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Setpoints for others change nothing, and those that PX4 refuses, which are told."""
        if not (self._parameters["MAV_FWDEXTSP"] and is_for(message, self._system_id, broadcast=True)):
            return
        message_id = message.get_msgId()
        if message_id == mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET:
            axis = THRUST_AXES.get(int(self._parameters["MAV_TYPE"]), NO_THRUST)
            setpoint = attitude_setpoint(now_us, message, axis)
        elif message_id == mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED:
            setpoint = self._trajectory(now_us, message, LOCAL, self._local(message))
        else:
            setpoint = self._trajectory(now_us, message, GLOBAL, self._global(message))
        if setpoint is not None:
            self._topics.offboard_setpoint = setpoint

    def on_time(self, now_us: int) -> None:
        """Nothing to do: the commander notices when setpoints stop."""

    def _trajectory(
        self, now_us: int, message: Any, refusals: Refusals, told: Vectors | None
    ) -> OffboardSetpoint | None:
        """The setpoint with the message's yaw, unless it asks for a force or for nothing."""
        if told is None:
            return None
        position, velocity, acceleration = told
        if message.type_mask & FORCE and has_any(acceleration):
            self._refuse(*refusals.force)
            return None
        if not any(map(has_any, told)):
            self._refuse(*refusals.invalid)
            return None
        mask = message.type_mask
        yaw = NAN if mask & YAW_IGNORE else finite_or_nan(message.yaw)
        yawspeed = NAN if mask & YAW_RATE_IGNORE else finite_or_nan(message.yaw_rate)
        trajectory = TrajectorySetpoint(now_us, position, velocity, acceleration, yaw, yawspeed, (0.0, 0.0, 0.0))
        return OffboardSetpoint(now_us, trajectory)

    def _refuse(self, text: str, event: str, *arguments: float) -> None:
        """PX4's text is critical, its event an error; where there is no text, there is neither."""
        if not text:
            return
        self._say(Severity.CRITICAL, f"{text}\t")
        self._say(Severity.ERROR, "", event, *arguments)

    def _local(self, message: Any) -> Vectors | None:
        position, velocity, acceleration = vectors(message, (message.x, message.y, message.z))
        frame = message.coordinate_frame
        if frame == mavlink.MAV_FRAME_LOCAL_NED:
            return position, velocity, acceleration
        if frame == mavlink.MAV_FRAME_BODY_NED:
            attitude = self._topics.vehicle_attitude
            heading = attitude.euler[2]
            return NAN3, turned(velocity, heading), rotated(rotation(attitude.q), acceleration)
        text, event = LOCAL.frame
        self._refuse(text.format(frame), event, frame)
        return None

    def _global(self, message: Any) -> Vectors | None:
        """Without a place on the globe that is told whole, the frame does not count."""
        here, frame = self._topics.vehicle_local_position, message.coordinate_frame
        position, velocity, acceleration = vectors(message, (0.0, 0.0, 0.0))
        if not all(axis == axis for axis in position):
            return NAN3, velocity, acceleration
        if not math.isfinite(here.ref_lat + here.ref_alt):
            return None
        down = self._down(frame, message.alt)
        if down is None:
            text, event = GLOBAL.frame
            self._refuse(text.format(frame), event, frame)
            return None
        if not math.isfinite(down):
            return None
        projection = geodesy.MapProjection(here.ref_lat, here.ref_lon)
        north, east = projection.project(message.lat_int * 1e-7, message.lon_int * 1e-7)
        return (north, east, down), velocity, acceleration

    def _down(self, frame: int, told_m: float) -> float | None:
        """Local z; NaN where what the height counts from is not known, None in a frame that PX4 does not know.

        A home above the local origin lowers what is told above home, where it should raise it: so v1.18 reckons
        (handle_message_set_position_target_global_int), and as home mostly lies at the origin, nobody minds.
        """
        home, here = self._topics.home_position, self._topics.vehicle_global_position
        ref_alt = self._topics.vehicle_local_position.ref_alt
        if frame == mavlink.MAV_FRAME_GLOBAL_INT:
            return ref_alt - told_m
        if frame == mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT:
            return home.alt - told_m - ref_alt if home.valid else NAN
        if frame == mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT:
            return ref_alt - (told_m + here.terrain_alt) if here.terrain_alt_valid else NAN
        return None


def vectors(message: Any, place: Vector3) -> Vectors:
    """Position, velocity, acceleration with NaN where the type mask ignores an axis."""
    mask = message.type_mask
    values = (*place, message.vx, message.vy, message.vz, message.afx, message.afy, message.afz)
    x, y, z, vx, vy, vz, ax, ay, az = (
        NAN if mask >> bit & 1 else finite_or_nan(value) for bit, value in enumerate(values)
    )
    return (x, y, z), (vx, vy, vz), (ax, ay, az)


def turned(vector: Vector3, heading: float) -> Vector3:
    """A vector of the heading's frame in NED; where one axis is free, all are."""
    forward, right, down = vector
    if not math.isfinite(forward + right + down):
        return NAN3
    cosine, sine = math.cos(heading), math.sin(heading)
    return (cosine * forward - sine * right, sine * forward + cosine * right, down)


def attitude_setpoint(now_us: int, message: Any, thrust_axis: Vector3) -> OffboardSetpoint | None:
    """Attitude if it is not ignored, else rates, with thrust along `thrust_axis`, or along all of the body's axes.

    All is passed on as it came: the controllers make of it what they can, and a rate that is ignored is NaN, as is one
    that is no number. Nothing comes of rates without roll or pitch, and of either without thrust.
    """
    mask = message.type_mask
    if mask & THRUST_BODY_SET:
        x, y, z = message.thrust_body
    elif not mask & THROTTLE_IGNORE:
        x, y, z = (message.thrust * along if along else 0.0 for along in thrust_axis)
    else:
        return None
    thrust_body = (x, y, z)
    yaw_rate = NAN if mask & YAW_RATE_OF_BODY_IGNORE else message.body_yaw_rate
    if not mask & ATTITUDE_IGNORE:
        w, x, y, z = message.q
        return OffboardSetpoint(now_us, attitude=VehicleAttitudeSetpoint(now_us, (w, x, y, z), yaw_rate, thrust_body))
    if mask & ROLL_OR_PITCH_RATE_IGNORE:
        return None
    rates = (message.body_roll_rate, message.body_pitch_rate, yaw_rate)
    return OffboardSetpoint(now_us, rates=VehicleRatesSetpoint(now_us, rates, thrust_body))
