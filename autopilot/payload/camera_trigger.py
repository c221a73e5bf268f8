"""When the camera is to take an image: once, by distance, by time. PX4's camera_trigger and camera_feedback (v1.18).

Runs where TRIG_MODE is above 0 at boot (rcS). TRIG_MODE 1 counts time and 4 distance, once a command has switched it
on; 2 and 3 do so from the start. That an image is wanted is told by CAMERA_TRIGGER, whose stream also asks the cameras
on its link for it; and where the vehicle was by CAMERA_IMAGE_CAPTURED of the autopilot, once it knows that.

Left out: interfaces other than MAVLink (TRIG_INTERFACE 3), power control, and feedback from a camera's pin.
"""

import math
from typing import ClassVar

from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import MAV_RESULT_ACCEPTED, CommandResult, obey_navigator
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import CameraCapture, CameraTriggered, Quaternion, Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import heading, product, quaternion
from sitl_emu.core.c_types import truncated

OFF, TIME_ON_COMMAND, TIME_ALWAYS, DISTANCE_ALWAYS, DISTANCE_ON_COMMAND = range(5)
"""TRIG_MODE."""
UNKNOWN_GROUND_M = -1.0
GIMBAL_SILENT_US = 1_000_000
"""CameraFeedback::Run."""
YAW_LOCK: int = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
DO_DIGICAM_CONTROL = mavlink.MAV_CMD_DO_DIGICAM_CONTROL
DO_SET_CAM_TRIGG_DIST = mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST
DO_TRIGGER_CONTROL = mavlink.MAV_CMD_DO_TRIGGER_CONTROL


class CameraTrigger:
    """Writes camera_trigger and camera_capture."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.CAMERA_TRIGGER)

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        """Only for a vehicle whose TRIG_MODE is above 0."""
        self._topics = topics
        self.mode = int(parameters["TRIG_MODE"])
        self.distance_m = float(parameters["TRIG_DISTANCE"])
        self.interval_s = float(parameters["TRIG_INTERVAL"]) * 1e-3
        self._shortest_us = round(float(parameters["TRIG_MIN_INTERVA"]) * 1e3)
        self.enabled = self.mode in (TIME_ALWAYS, DISTANCE_ALWAYS)
        self.paused = False
        self._sequence = 0
        self._shot_at: tuple[float, float] | None = None
        self._shot_us = -self._shortest_us
        self._due_us = 0
        self._commands_seen = 0

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """All of COMMANDS are accepted."""
        number = command.command
        first = whole(command.param1)
        if number == DO_DIGICAM_CONTROL:
            if whole(command.param5) == 1:
                self._shoot(now_us)
        elif number == DO_TRIGGER_CONTROL:
            if whole(command.param3) in (0, 1):
                self.paused = whole(command.param3) == 1
            if whole(command.param2) == 1:
                self._sequence = 0
            if first in (0, 1):
                self._enable(now_us, on=first == 1)
        elif number == DO_SET_CAM_TRIGG_DIST:
            if command.param1 > 0.0:
                self.distance_m = command.param1
                self.paused = False
                self._enable(now_us, on=True)
            elif first == 0:
                self.paused, self._shot_at = True, None
            elif first == -1:
                self._enable(now_us, on=False)
            if command.param3 > 0.0:
                self._shoot(now_us)
        elif command.param1 > 0.0:
            self.interval_s = command.param1 * 1e-3
        return CommandResult(MAV_RESULT_ACCEPTED)

    def update(self, now_us: int) -> None:
        """At 50 Hz: what the mission commands, and whether it is time or far enough for the next image."""
        self._commands_seen = obey_navigator(self, now_us, self._topics, self._commands_seen)
        if not self.enabled or self.paused:
            return
        if self.mode in (TIME_ON_COMMAND, TIME_ALWAYS):
            if now_us >= self._due_us:
                self._due_us = now_us + truncated(self.interval_s * 1e6)
                self._shoot(now_us)
        else:
            self._follow_distance(now_us)

    def _enable(self, now_us: int, *, on: bool) -> None:
        if on is not self.enabled:
            self.enabled = on
            self._shot_at, self._due_us = None, now_us

    def _follow_distance(self, now_us: int) -> None:
        local = self._topics.vehicle_local_position
        if not local.xy_valid:
            return
        last = self._shot_at
        if last is None or math.hypot(local.x - last[0], local.y - last[1]) >= self.distance_m:
            self._shot_at = (local.x, local.y)
            self._shoot(now_us)

    def _shoot(self, now_us: int) -> None:
        if now_us - self._shot_us < self._shortest_us:
            return
        self._shot_us = now_us
        topics, sequence = self._topics, self._sequence
        topics.camera_trigger = CameraTriggered(now_us, sequence)
        position = topics.vehicle_global_position
        if math.isfinite(position.lat) and topics.vehicle_attitude.timestamp:
            ground_m = position.alt - position.terrain_alt if position.terrain_alt_valid else UNKNOWN_GROUND_M
            topics.camera_capture = CameraCapture(
                now_us, sequence, position.lat, position.lon, position.alt, ground_m, self._camera_attitude(now_us)
            )
        self._sequence += 1

    def _camera_attitude(self, now_us: int) -> Quaternion:
        """The gimbal's while it tells of it, about the north or the vehicle's nose; else the vehicle's."""
        gimbal, vehicle = self._topics.gimbal_device_attitude_status, self._topics.vehicle_attitude
        if not gimbal.timestamp or now_us - gimbal.timestamp >= GIMBAL_SILENT_US:
            return vehicle.q
        if gimbal.device_flags & YAW_LOCK:
            return gimbal.q
        return product(quaternion(0.0, 0.0, heading(vehicle.q)), gimbal.q)


def whole(value: float) -> int:
    """A parameter as a whole number, cut as C++ does; -2, which means nothing, for one that is not given."""
    return int(value) if math.isfinite(value) else -2
