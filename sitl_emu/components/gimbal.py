"""A gimbal device that speaks the MAVLink gimbal protocol v2: component 154, a state machine on simulated time.

https://mavlink.io/en/services/gimbal_v2.html. It has three axes, holds roll and pitch against the horizon, and yaw
against north (YAW_LOCK) or the vehicle's heading; it moves no faster than its motors and no further than its stops, and
tells its attitude ten times a second, unless it is asked to do so more or less often, or not at all. The vehicle's
attitude comes from AUTOPILOT_STATE_FOR_GIMBAL_DEVICE; it is commanded by GIMBAL_DEVICE_SET_ATTITUDE of the autopilot's
gimbal manager alone.
"""

import math
from typing import Any

from sitl_emu.components.component import COMMANDS, NEVER_US, Component, text
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import Euler, Quaternion, euler, quaternion
from sitl_emu.core.geodesy import wrap_pi
from sitl_emu.vehicles.description import Gimbal as GimbalData

INFORMATION = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION
ATTITUDE_STATUS = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS
SET_ATTITUDE = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_SET_ATTITUDE
AUTOPILOT_STATE = mavlink.MAVLINK_MSG_ID_AUTOPILOT_STATE_FOR_GIMBAL_DEVICE
ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED
NEUTRAL: int = mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL
YAW_LOCK: int = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
STABILIZED: int = mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK
IN_VEHICLE_FRAME: int = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
IN_EARTH_FRAME: int = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
CAPABILITIES = (
    mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_ROLL_AXIS
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_ROLL_LOCK
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_LOCK
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_FOLLOW
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK
)
STATUS_EVERY_US = 100_000
FIRMWARE_VERSION = 1
AT_REST: Euler = (0.0, 0.0, 0.0)
NOT_A_NUMBER = (math.nan, math.nan, math.nan)


class Gimbal:
    """The gimbal of one vehicle."""

    def __init__(self, data: GimbalData, system_id: int) -> None:
        """`system_id` is the vehicle's."""
        self._data = data
        self._component = Component(system_id, mavlink.MAV_COMP_ID_GIMBAL, mavlink.MAV_TYPE_GIMBAL)
        self.outbox = self._component.outbox
        self.due_us = 0
        self._rate_max = math.radians(data.rate_max_deg_s)
        roll, yaw = math.radians(data.roll_max_deg), math.radians(data.yaw_max_deg)
        pitch_min, pitch_max = math.radians(data.pitch_min_deg), math.radians(data.pitch_max_deg)
        self._lowest, self._highest = (-roll, pitch_min, -yaw), (roll, pitch_max, yaw)
        self._heading = 0.0
        self._locked = False
        self._angles: Euler = (0.0, math.radians(data.start_pitch_deg), 0.0)
        """Roll and pitch against the horizon, yaw against north if locked, else against the vehicle's heading."""
        self._target: Euler = self._angles
        """NaN where only a rate is wanted."""
        self._rates: Euler = AT_REST
        """Wanted by who steers by rates."""
        self._moving: Euler = AT_REST
        self._moved_us = 0
        self._status_every_us = STATUS_EVERY_US
        self._status_us = 0

    def on_datagram(self, now_us: int, data: bytes) -> None:
        """What came from the autopilot's end of the wire."""
        component = self._component
        for fields in component.fields(data, AUTOPILOT_STATE):
            self._move(now_us)
            self._turn_with_vehicle(euler(fields[1:5])[2])
        for fields in component.fields(data, SET_ATTITUDE):
            w, x, y, z, *rates, flags, system, number = fields
            if system in (0, component.system_id) and number in (0, component.component_id):
                self._move(now_us)
                self._set_attitude((w, x, y, z), (rates[0], rates[1], rates[2]), flags)
        for message in component.messages(data, COMMANDS):
            self._on_command(now_us, message)

    def looks(self, now_us: int) -> Quaternion:
        """Where it looks at a time: roll and pitch against the horizon, yaw against the vehicle's heading."""
        dt_s = max(now_us - self._moved_us, 0) * 1e-6
        roll, pitch, yaw = (self._axis(axis, dt_s) for axis in range(3))
        return quaternion(roll, pitch, wrap_pi(yaw - self._heading) if self._locked else yaw)

    def keep_alive(self, clock_s: float) -> None:
        """See Component.keep_alive."""
        self._component.keep_alive(clock_s)

    def on_time(self, now_us: int) -> None:
        """Heartbeat, motion, and the attitude told."""
        due_us = self._component.beat(now_us)
        if now_us >= self._status_us:
            self._status_us = now_us + self._status_every_us
            self._move(now_us)
            self._component.send(self._attitude_status(now_us))
        self.due_us = min(due_us, self._status_us)

    # --- commands -------------------------------------------------------------------------------------------

    def _on_command(self, now_us: int, message: Any) -> None:
        command = self._component.command(message)
        if command is None:
            return
        number, message_id = command.number, command.whole(1)
        requests = (mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL)
        known = number in requests and message_id in (INFORMATION, ATTITUDE_STATUS)
        if number == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL and message_id != ATTITUDE_STATUS:
            known = False
        if not known:
            if command.addressed:
                self._component.acknowledge(command, UNSUPPORTED)
            return
        self._component.acknowledge(command, ACCEPTED)
        if number == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            interval_us = command.whole(2)
            stopped, chosen_us = interval_us < 0, interval_us or STATUS_EVERY_US
            self._status_every_us = NEVER_US if stopped else chosen_us
            self._status_us = NEVER_US if stopped else now_us
            self.due_us = now_us
        elif message_id == INFORMATION:
            self._component.send(self._information(now_us))
        else:
            self._move(now_us)
            self._component.send(self._attitude_status(now_us))

    # --- motion ---------------------------------------------------------------------------------------------

    def _set_attitude(self, q: Quaternion, rates: Euler, flags: int) -> None:
        locked = bool(flags & YAW_LOCK)
        if locked is not self._locked:
            self._locked = locked
            roll, pitch, yaw = self._angles
            self._angles = (roll, pitch, wrap_pi(yaw + self._heading if locked else yaw - self._heading))
            self._target, self._rates = self._angles, AT_REST
        if flags & NEUTRAL:
            self._target, self._rates = AT_REST, AT_REST
        elif all(math.isfinite(value) for value in q):
            self._target = euler(q)
            self._rates = AT_REST
        elif any(math.isfinite(rate) for rate in rates):
            self._target = NOT_A_NUMBER
            roll_rate, pitch_rate, yaw_rate = (rate if math.isfinite(rate) else 0.0 for rate in rates)
            self._rates = (roll_rate, pitch_rate, yaw_rate)

    def _turn_with_vehicle(self, heading: float) -> None:
        """The vehicle has turned: a locked gimbal whose yaw axis comes to its stop is dragged along."""
        self._heading = heading
        if self._locked:
            roll, pitch, yaw = self._angles
            joint = wrap_pi(yaw - heading)
            at_stop = max(self._lowest[2], min(self._highest[2], joint))
            if at_stop != joint:
                self._angles = (roll, pitch, wrap_pi(at_stop + heading))

    def _move(self, now_us: int) -> None:
        """Let the motors turn since the last look."""
        dt_s = (now_us - self._moved_us) * 1e-6
        if dt_s <= 0.0:
            return
        self._moved_us = now_us
        roll, pitch, yaw = (self._axis(axis, dt_s) for axis in range(3))
        before = self._angles
        self._angles = (roll, pitch, yaw)
        self._moving = (
            (roll - before[0]) / dt_s,
            (pitch - before[1]) / dt_s,
            wrap_pi(yaw - before[2]) / dt_s,
        )

    def _axis(self, axis: int, dt_s: float) -> float:
        angle, target, limit = self._angles[axis], self._target[axis], self._rate_max * dt_s
        turns = axis == YAW
        if math.isfinite(target):
            way = wrap_pi(target - angle) if turns else target - angle
            angle += max(-limit, min(limit, way))
        else:
            angle += max(-limit, min(limit, self._rates[axis] * dt_s))
        zero = self._heading if turns and self._locked else 0.0
        joint = wrap_pi(angle - zero) if turns else angle
        joint = max(self._lowest[axis], min(self._highest[axis], joint))
        return wrap_pi(joint + zero) if turns else joint

    # --- messages -------------------------------------------------------------------------------------------

    def _attitude_status(self, now_us: int) -> Any:
        flags = STABILIZED | (YAW_LOCK | IN_EARTH_FRAME if self._locked else IN_VEHICLE_FRAME)
        return mavlink.MAVLink_gimbal_device_attitude_status_message(
            0, 0, now_us // 1000, flags, quaternion(*self._angles), *self._moving, 0, self._heading, math.nan, 0
        )

    def _information(self, now_us: int) -> Any:
        (roll_min, pitch_min, yaw_min), (roll_max, pitch_max, yaw_max) = self._lowest, self._highest
        return mavlink.MAVLink_gimbal_device_information_message(
            now_us // 1000,
            text(self._data.vendor, 32),
            text(self._data.model, 32),
            b"",
            FIRMWARE_VERSION,
            0,
            0,
            CAPABILITIES,
            0,
            roll_min,
            roll_max,
            pitch_min,
            pitch_max,
            yaw_min,
            yaw_max,
        )


YAW = 2
"""Index of the axis that turns without end."""
