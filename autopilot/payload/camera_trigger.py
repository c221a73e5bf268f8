"""When the camera is to take an image: once, by distance, by time. PX4's camera_trigger and camera_feedback (v1.18).

Runs where TRIG_MODE is above 0 at boot (rcS) and TRIG_INTERFACE is 3, MAVLink. TRIG_MODE 1 counts time and 4 distance,
once a command has switched it on; 2 and 3 do so from the start. That an image is wanted is told by CAMERA_TRIGGER,
whose stream also asks the cameras on its link for it; and where the vehicle was by CAMERA_IMAGE_CAPTURED of the
autopilot, once it knows that.

It takes one command a run, 20 times a second, and answers it then. The image itself is one timer's (_engagecall): a
series by time is its period, counted from planned times, and any other image takes that timer away from the series.

OBLIQUE_SURVEY counts distance too, and between two images has the gimbal roll on to the next of its poses.

Left out: other interfaces, power control, and feedback from a camera's pin.
"""

import math
from collections import deque
from typing import ClassVar

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import (
    MAV_RESULT_ACCEPTED,
    MAV_RESULT_TEMPORARILY_REJECTED,
    CommandResult,
    answer_later,
    give_inside,
    obey_navigator,
    tell,
)
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import CameraCapture, CameraTriggered, Quaternion, Topics, VehicleCommand
from sitl_emu.core import c_types
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import heading, product, quaternion

OFF, TIME_ON_COMMAND, TIME_ALWAYS, DISTANCE_ALWAYS, DISTANCE_ON_COMMAND = range(5)
"""TRIG_MODE."""
MAVLINK_INTERFACE = 3
"""TRIG_INTERFACE."""
RUN_US = 50_000
"""CameraTrigger::Run."""
LOOKED_FOR = ("TRIG_ACT_TIME", "TRIG_DISTANCE", "TRIG_INTERVAL", "TRIG_MIN_INTERVA")
"""Parameters that are announced from its start on."""
COMMANDS_KEPT = 8
"""vehicle_command's ORB_QUEUE_LENGTH."""
NEVER_US = 1 << 62
UNKNOWN_GROUND_M = -1.0
GIMBAL_SILENT_US = 1_000_000
"""CameraFeedback::Run."""
YAW_LOCK: int = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
DO_DIGICAM_CONTROL = mavlink.MAV_CMD_DO_DIGICAM_CONTROL
DO_SET_CAM_TRIGG_DIST = mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST
DO_TRIGGER_CONTROL = mavlink.MAV_CMD_DO_TRIGGER_CONTROL
OBLIQUE_SURVEY = mavlink.MAV_CMD_OBLIQUE_SURVEY
FEWEST_POSES = 2.0
ACCEPTED = CommandResult(MAV_RESULT_ACCEPTED)


def starts(parameters: Parameters) -> bool:
    """Whether there is one; interfaces other than MAVLink PX4's simulated vehicles do not know, and it fails to start.

    camera_feedback runs without it, and has nothing to do.
    """
    return bool(parameters["TRIG_MODE"] > 0 and parameters["TRIG_INTERFACE"] == MAVLINK_INTERFACE)


class CameraTrigger:
    """Writes camera_trigger and camera_capture."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.CAMERA_TRIGGER)

    def __init__(self, topics: Topics, parameters: Parameters, outgoing: OutgoingCommands) -> None:
        """Only for a vehicle where it starts."""
        self._topics = topics
        self._outgoing = outgoing
        self._parameters = parameters
        parameters.use(LOOKED_FOR)
        self._system = int(parameters["MAV_SYS_ID"])
        self.mode = int(parameters["TRIG_MODE"])
        self.distance_m = float(parameters["TRIG_DISTANCE"])
        self.interval_ms = float(parameters["TRIG_INTERVAL"])
        self._shortest_us = float(parameters["TRIG_MIN_INTERVA"]) * 1e3
        self.enabled = self.mode in (TIME_ALWAYS, DISTANCE_ALWAYS)
        self.paused = False
        self._one_shot = False
        self._sequence = 0
        self._shot_at: tuple[float, float] | None = None
        self._shot_us = 0
        """0: there was none yet."""
        self._commands: deque[VehicleCommand] = deque(maxlen=COMMANDS_KEPT)
        self._commands_seen = 0
        self._target = (0, 0)
        """System and component that the last command was for."""
        self._poses = self._pose = 0
        """Of an oblique survey: how many there are, none without one, and which it is."""
        self._pitch_deg = self._roll_deg = 0.0
        self._posed = False
        """Whether the gimbal has been told its pose for the next image."""
        self._run_us = 0
        self._engage_us, self._period_us = NEVER_US, 0
        if self.mode == TIME_ALWAYS:
            self._start_series(0)

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """One of COMMANDS waits for its run, which answers it."""
        self._commands.append(command)
        return None

    def update(self, now_us: int) -> None:
        """Every tick: run if it is time to, and take the image that is due."""
        self._commands_seen = obey_navigator(self, now_us, self._topics, self._commands_seen)
        if now_us >= self._run_us:
            self._run_us = now_us + RUN_US
            self._run(now_us)
        if now_us >= self._engage_us:
            self._engage_us = self._following_us(now_us)
            self._engage(now_us)

    def _run(self, now_us: int) -> None:
        was = (self.enabled, self.paused)
        command = self._commands.popleft() if self._commands else None
        result = self._obey(now_us, command) if command is not None else ACCEPTED
        if was != (self.enabled, self.paused) or self._one_shot:
            self._change(now_us)
        if self.mode in (DISTANCE_ALWAYS, DISTANCE_ON_COMMAND):
            self._follow_distance(now_us)
        if self._one_shot:
            self._shoot_once(now_us)
            self._one_shot = False
        if command is not None and command.from_external:
            answer_later(self._topics, command, result)
        elif command is not None:
            tell(self._topics, now_us, command, result)

    def _obey(self, now_us: int, command: VehicleCommand) -> CommandResult:
        number, first = command.command, whole(command.param1)
        is_ours = not command.from_external
        self._target = (self._system if is_ours else command.target_system, command.target_component)
        if number == DO_DIGICAM_CONTROL:
            if now_us - self._shot_us < self._shortest_us:
                return CommandResult(MAV_RESULT_TEMPORARILY_REJECTED)
            if whole(command.param5) == 1:
                self._one_shot = True
        elif number == DO_TRIGGER_CONTROL:
            if whole(command.param3) in (0, 1):
                self.paused = whole(command.param3) == 1
            if whole(command.param2) == 1:
                self._sequence = 0
            if first in (0, 1):
                self.enabled = first == 1
        elif number == DO_SET_CAM_TRIGG_DIST:
            self._set_distance(command.param1)
            if command.param3 > 0.0:
                self._one_shot = True
        elif number == OBLIQUE_SURVEY:
            self._set_distance(command.param1)
            self._survey(command)
        elif command.param1 > 0.0:
            self.interval_ms = command.param1
            self._parameters.set("TRIG_INTERVAL", self.interval_ms, notify=False)
        return ACCEPTED

    def _set_distance(self, distance_m: float) -> None:
        """And count it from here, with an image at once."""
        if distance_m > 0.0:
            self.distance_m = distance_m
            self._parameters.set("TRIG_DISTANCE", distance_m, notify=False)
            self.enabled, self.paused, self._shot_at = True, False, None
        elif whole(distance_m) == 0:
            self.paused = True
        elif whole(distance_m) == -1:
            self.enabled = False

    def _survey(self, command: VehicleCommand) -> None:
        """With how many poses, from -roll to roll, and how far apart images are at least; a single pose is none."""
        if command.param3 > 0.0:
            self._shortest_us = command.param3 * 1e3
            self._parameters.set("TRIG_MIN_INTERVA", command.param3, notify=False)
        self._poses = 0
        if command.param4 >= FEWEST_POSES:
            self._poses, self._pose, self._posed = whole(command.param4), 0, False
            self._roll_deg, self._pitch_deg = command.param5, command.param6

    def _change(self, now_us: int) -> None:
        """It was switched on, off, or paused, or a single image is wanted."""
        goes_on = self.enabled and not self.paused
        if not goes_on and not self._one_shot:
            self._engage_us = NEVER_US
            if self.mode in (DISTANCE_ALWAYS, DISTANCE_ON_COMMAND):
                self._shot_at = None
        if goes_on and self.mode == TIME_ON_COMMAND:
            self._start_series(now_us)

    def _follow_distance(self, now_us: int) -> None:
        local = self._topics.vehicle_local_position
        if not self.enabled or self.paused or not local.xy_valid:
            return
        if self._shot_at is None:
            self._shot_at = (local.x, local.y)
            self._shoot_once(now_us)
        if self._poses and not self._posed and now_us - self._shot_us > self._shortest_us:
            self._posed = True
            self._roll_on(now_us)
        if math.hypot(local.x - self._shot_at[0], local.y - self._shot_at[1]) >= self.distance_m:
            self._shot_at, self._posed = (local.x, local.y), False
            self._shoot_once(now_us)

    def _roll_on(self, now_us: int) -> None:
        """Have the gimbal take its next pose (adjust_roll); the command is sent to all links as well."""
        self._pose = (self._pose + 1) % self._poses
        roll_deg = 2.0 * self._roll_deg / (self._poses - 1) * self._pose - self._roll_deg
        system, component = self._target
        command = VehicleCommand(
            mavlink.MAV_CMD_DO_MOUNT_CONTROL,
            *(self._pitch_deg, roll_deg, 0.0, 0.0, 0.0, 0.0),
            float(mavlink.MAV_MOUNT_MODE_MAVLINK_TARGETING),
            target_system=system,
            target_component=component,
            from_external=False,
        )
        give_inside(self._topics, now_us, command)
        self._outgoing.give(command)

    # --- the timer that engages the camera --------------------------------------------------------------------

    def _start_series(self, now_us: int) -> None:
        self._engage_us, self._period_us = now_us, c_types.integer("Q", c_types.product(self.interval_ms, 1e3))

    def _shoot_once(self, now_us: int) -> None:
        self._engage_us, self._period_us = now_us, 0

    def _following_us(self, now_us: int) -> int:
        """When the timer that is due is due again: a period after it was planned, and not yet (hrt_call_invoke)."""
        period_us = self._period_us
        if not period_us:
            return NEVER_US
        return self._engage_us + period_us * ((now_us - self._engage_us) // period_us + 1)

    def _engage(self, now_us: int) -> None:
        if self._shot_us and now_us - self._shot_us < self._shortest_us:
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
    """A parameter as a whole number (commandParamToInt); what is not given is none that means anything."""
    return c_types.truncated(value + math.copysign(0.5, value))
