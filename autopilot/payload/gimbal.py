"""The gimbal manager: who may point the gimbal, and where it is to look. PX4's modules/gimbal (v1.18).

Runs where MNT_MODE_IN is 0 or above at boot (rcS). MNT_MODE_IN 0 (automatic) and 4 take the MAVLink gimbal protocol v2
(https://mavlink.io/en/services/gimbal_v2.html), 2 regions of interest alone, 3 the old DO_MOUNT commands alone; 5 takes
nothing, and has the gimbal look north and MNT_FIXED_PITCH up, against the horizon (InputFixed). The output is a MAVLink
gimbal (MNT_MODE_OUT 2), found by asking everybody for GIMBAL_DEVICE_INFORMATION once a second.
Nobody is in primary control until DO_GIMBAL_MANAGER_CONFIGURE says who; there is no secondary control, as in PX4. A
region of interest needs no control; the gimbal is aimed at it when it is set, from where the vehicle is then, and not
again while the vehicle moves (OutputMavlinkV2::update). Rates that nobody renews end after two seconds.

Left out: sticks and RC (MNT_MODE_IN 1), servos and gimbal protocol v1 (MNT_MODE_OUT 0 and 1), several gimbals.
"""

import math
from typing import ClassVar, Final

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import (
    MAV_RESULT_ACCEPTED,
    MAV_RESULT_DENIED,
    CommandResult,
    nearest,
    obey_navigator,
)
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    GimbalDeviceSetAttitude,
    GimbalManagerInformation,
    GimbalManagerSetAttitude,
    GimbalManagerStatus,
    Quaternion,
    Topics,
    Vector3,
    VehicleCommand,
    VehicleRoi,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import quaternion
from sitl_emu.core.geodesy import MapProjection, bearing_rad

AUTOMATIC, RC, ROI, MOUNT, PROTOCOL_V2, FIXED = range(6)
"""MNT_MODE_IN."""
AUTOPILOT = mavlink.MAV_COMP_ID_AUTOPILOT1
CONFIGURE = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
PITCHYAW = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
MOUNT_CONTROL = mavlink.MAV_CMD_DO_MOUNT_CONTROL
MOUNT_CONFIGURE = mavlink.MAV_CMD_DO_MOUNT_CONFIGURE
RETRACT: int = mavlink.GIMBAL_MANAGER_FLAGS_RETRACT
NEUTRAL: int = mavlink.GIMBAL_MANAGER_FLAGS_NEUTRAL
ROLL_LOCK: int = mavlink.GIMBAL_MANAGER_FLAGS_ROLL_LOCK
PITCH_LOCK: int = mavlink.GIMBAL_MANAGER_FLAGS_PITCH_LOCK
YAW_LOCK: int = mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK
LOCKS = (ROLL_LOCK, PITCH_LOCK, YAW_LOCK)
IN_VEHICLE_FRAME: int = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
IN_EARTH_FRAME: int = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
ROI_NONE, ROI_WPNEXT, ROI_LOCATION = 0, 1, 3
UNCHANGED, ITSELF, RELEASE = -1, -2, -3
FORWARD: Quaternion = (1.0, 0.0, 0.0, 0.0)
NO_ATTITUDE: Quaternion = (NAN, NAN, NAN, NAN)
ASK_EVERY_US = 1_000_000
NEUTRAL_TYPE, ANGLE, LONLAT = range(3)
"""ControlData::Type, what is wanted."""
BODY_FRAME, ANGULAR_RATE, ABSOLUTE_FRAME = range(3)
"""ControlData::TypeData::TypeAngle::Frame of an axis, and DO_MOUNT_CONFIGURE's param5 to 7."""
SETPOINT_TIMEOUT_US: Final = 2_000_000
"""OutputBase::check_and_handle_setpoint_timeout."""
SMALLEST_RATE: Final = 1.2e-7
"""Below is none there (FLT_EPSILON)."""


class Gimbal:
    """Writes gimbal_device_set_attitude, gimbal_manager_information and gimbal_manager_status."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.GIMBAL)

    def __init__(self, topics: Topics, parameters: Parameters, outgoing: OutgoingCommands) -> None:
        """Only for a vehicle whose MNT_MODE_IN is 0 or above."""
        self._topics = topics
        self._parameters = parameters
        self._outgoing = outgoing
        self._system = int(parameters["MAV_SYS_ID"])
        mode = int(parameters["MNT_MODE_IN"])
        self._takes_roi = mode in (AUTOMATIC, ROI, PROTOCOL_V2)
        self._takes_mount = mode in (AUTOMATIC, MOUNT, PROTOCOL_V2)
        self._takes_v2 = mode in (AUTOMATIC, PROTOCOL_V2)
        self._is_fixed = mode == FIXED
        self._control = (0, 0)
        self._is_new = False
        """Whether an input has said something since the output took what is wanted."""
        self._said_us = 0
        self._type = NEUTRAL_TYPE
        self._wanted_q, self._wanted_rates = NO_ATTITUDE, NAN3
        self._frames = [BODY_FRAME] * 3
        self._place = (NAN, NAN, NAN)
        self._offsets = NAN3
        self._q, self._rates = NO_ATTITUDE, NAN3
        self._locks = ROLL_LOCK | PITCH_LOCK
        self._roi = topics.vehicle_roi
        self._triplet = topics.position_setpoint_triplet
        self._follows_waypoint = False
        self._set_attitude = topics.gimbal_manager_set_attitude
        self._status = topics.gimbal_device_attitude_status
        self._commands_seen = 0
        self._ask_us = 0
        self._device = self._told_device = 0

    # --- commands -------------------------------------------------------------------------------------------

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Decide on one of COMMANDS; None gives no ack, as to one for another component."""
        number = command.command
        if command.target_component not in (0, AUTOPILOT):
            return None
        if number in (MOUNT_CONTROL, MOUNT_CONFIGURE):
            if not self._takes_mount:
                return None
            if number == MOUNT_CONTROL:
                self._mount_control(now_us, command)
            else:
                kinds = (command.param5, command.param6, command.param7)
                self._frames = [kind if 0 <= kind <= ABSOLUTE_FRAME else BODY_FRAME for kind in map(nearest, kinds)]
                self._is_new = True
            return CommandResult(MAV_RESULT_ACCEPTED)
        if not self._takes_v2:
            return None
        source = (command.source_system, command.source_component) if command.from_external else self._itself
        if number == CONFIGURE:
            system = self._controller(command.param1, 0, source[0])
            self._control = (system, self._controller(command.param2, 1, source[1]))
            return CommandResult(MAV_RESULT_ACCEPTED)
        self._is_new = True
        if source != self._control:
            return CommandResult(MAV_RESULT_DENIED)
        angles = (command.param1, command.param2)
        pitch, yaw = (math.radians(angle) if math.isfinite(angle) else 0.0 for angle in angles)
        rates = (NAN, math.radians(command.param3), math.radians(command.param4))
        flags = int(command.param5) if math.isfinite(command.param5) and command.param5 >= 0.0 else 0
        self._point(now_us, flags, quaternion(0.0, pitch, yaw), rates)
        return CommandResult(MAV_RESULT_ACCEPTED)

    @property
    def _itself(self) -> tuple[int, int]:
        return self._system, AUTOPILOT

    def _controller(self, value: float, index: int, source: int) -> int:
        present = self._control[index]
        wanted = nearest(value) if math.isfinite(value) else UNCHANGED
        if wanted == ITSELF:
            return self._itself[index]
        if wanted == RELEASE:
            return 0 if present == source else present
        return wanted if 0 <= wanted <= 255 else present

    def _mount_control(self, now_us: int, command: VehicleCommand) -> None:
        mode = int(command.param7) if math.isfinite(command.param7) else -1
        if mode in (mavlink.MAV_MOUNT_MODE_RETRACT, mavlink.MAV_MOUNT_MODE_NEUTRAL):
            self._want(now_us, NEUTRAL_TYPE)
        elif mode == mavlink.MAV_MOUNT_MODE_MAVLINK_TARGETING:
            pitch, roll, yaw = (math.radians(value) for value in command[1:4])
            if yaw > math.pi and self._takes_v2:
                yaw -= 2.0 * math.pi
            self._point(now_us, ROLL_LOCK | PITCH_LOCK, quaternion(roll, pitch, yaw), NAN3)
        elif mode == mavlink.MAV_MOUNT_MODE_GPS_POINT:
            self._look_at(now_us, (command.param5, command.param6, command.param4))

    # --- every cycle ----------------------------------------------------------------------------------------

    def update(self, now_us: int) -> None:
        """At 50 Hz: what comes in, and what is wanted of the device."""
        topics = self._topics
        self._commands_seen = obey_navigator(self, now_us, topics, self._commands_seen)
        if topics.gimbal_manager_set_attitude is not self._set_attitude:
            self._set_attitude = topics.gimbal_manager_set_attitude
            self._take_set_attitude(now_us, self._set_attitude)
        if topics.vehicle_roi is not self._roi:
            self._roi = topics.vehicle_roi
            if self._takes_roi:
                self._take_roi(now_us, self._roi)
        if topics.position_setpoint_triplet is not self._triplet:
            self._triplet = topics.position_setpoint_triplet
            if self._follows_waypoint:
                self._look_at_waypoint(now_us)
        if self._is_fixed:
            fixed_q = quaternion(0.0, math.radians(self._parameters["MNT_FIXED_PITCH"]), 0.0)
            self._point(now_us, ROLL_LOCK | PITCH_LOCK | YAW_LOCK, fixed_q, NAN3)
        if self._takes_v2:
            self._tell(now_us)
        self._end_old_rates(now_us)
        device = topics.gimbal_device_information
        if not device.timestamp and now_us >= self._ask_us:
            self._ask_us = now_us + ASK_EVERY_US
            ask = VehicleCommand(
                mavlink.MAV_CMD_REQUEST_MESSAGE,
                float(mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION),
                *(0.0,) * 6,
                from_external=False,
            )
            self._outgoing.give(ask)
            return
        if self._is_new:
            self._is_new = False
            self._take_wanted()
        self._device = device.gimbal_device_id
        frame = IN_EARTH_FRAME if self._locks & YAW_LOCK else IN_VEHICLE_FRAME
        topics.gimbal_device_set_attitude = GimbalDeviceSetAttitude(
            now_us, self._device, self._locks | frame, self._q, self._rates
        )

    def _tell(self, now_us: int) -> None:
        """Who controls the device, whenever that speaks; and what it can, once it was found."""
        topics = self._topics
        if topics.gimbal_device_attitude_status is not self._status:
            self._status = topics.gimbal_device_attitude_status
            topics.gimbal_manager_status = GimbalManagerStatus(
                now_us, self._status.device_flags, self._device, *self._control
            )
        if self._device != self._told_device:
            self._told_device = self._device
            can = topics.gimbal_device_information
            stops = (can.pitch_min, can.pitch_max, can.yaw_min, can.yaw_max)
            topics.gimbal_manager_information = GimbalManagerInformation(now_us, can.cap_flags, *stops, self._device)

    def _end_old_rates(self, now_us: int) -> None:
        """Or the gimbal would turn for ever."""
        rates = self._wanted_rates
        if self._type != ANGLE or now_us - self._said_us <= SETPOINT_TIMEOUT_US:
            return
        if any(abs(rate) > SMALLEST_RATE for rate in rates):
            roll_rate, pitch_rate, yaw_rate = (0.0 if abs(rate) > SMALLEST_RATE else rate for rate in rates)
            self._wanted_rates = (roll_rate, pitch_rate, yaw_rate)
            self._is_new = True

    def _take_set_attitude(self, now_us: int, wanted: GimbalManagerSetAttitude) -> None:
        if not self._takes_v2:
            return
        self._is_new = True
        if (wanted.origin_sysid, wanted.origin_compid) != self._control:
            return
        rates = wanted.angular_velocity
        if wanted.manual:
            pitch_rate = math.radians(self._parameters["MNT_RATE_PITCH"]) * rates[1]
            rates = (rates[0], pitch_rate, math.radians(self._parameters["MNT_RATE_YAW"]) * rates[2])
        self._point(now_us, wanted.flags, wanted.q, rates)

    def _take_roi(self, now_us: int, roi: VehicleRoi) -> None:
        if roi.mode not in (ROI_NONE, ROI_WPNEXT, ROI_LOCATION):
            return
        if roi.mode == ROI_LOCATION:
            self._look_at(now_us, (roi.lat, roi.lon, roi.alt))
        elif roi.mode == ROI_WPNEXT:
            self._look_at_waypoint(now_us)
            self._offsets = (roi.roll_offset, roi.pitch_offset, roi.yaw_offset)
        else:
            self._want(now_us, NEUTRAL_TYPE)
        self._follows_waypoint = roi.mode == ROI_WPNEXT

    # --- what is wanted ---------------------------------------------------------------------------------------

    def _want(self, now_us: int, kind: int) -> None:
        self._type, self._said_us, self._is_new = kind, now_us, True
        self._follows_waypoint = False

    def _point(self, now_us: int, flags: int, q: Quaternion, rates: Vector3) -> None:
        """To retract it is not implemented there (_set_control_data_from_set_attitude)."""
        if flags & RETRACT:
            self._want(now_us, self._type)
        elif flags & NEUTRAL:
            self._want(now_us, NEUTRAL_TYPE)
        else:
            self._want(now_us, ANGLE)
            self._wanted_q, self._wanted_rates = q, rates
            self._frames = [ABSOLUTE_FRAME if flags & lock else BODY_FRAME for lock in LOCKS]

    def _look_at(self, now_us: int, place: Vector3) -> None:
        self._want(now_us, LONLAT)
        self._place, self._offsets = place, NAN3

    def _look_at_waypoint(self, now_us: int) -> None:
        current = self._topics.position_setpoint_triplet.current
        self._want(now_us, LONLAT)
        self._place = (current.lat, current.lon, current.alt)
        self._follows_waypoint = True

    # --- what the device is told ------------------------------------------------------------------------------

    def _take_wanted(self) -> None:
        """OutputBase::_set_angle_setpoints."""
        if self._type == ANGLE:
            self._q, self._rates = self._wanted_q, self._wanted_rates
            for frame, lock in zip(self._frames, LOCKS, strict=True):
                if frame == ABSOLUTE_FRAME:
                    self._locks |= lock
                elif frame == BODY_FRAME:
                    self._locks &= ~lock
        elif self._type == LONLAT:
            self._aim()
        else:
            self._q, self._rates, self._locks = FORWARD, NAN3, 0

    def _aim(self) -> None:
        """From where the vehicle is; yaw against north."""
        here, (lat, lon, alt) = self._topics.vehicle_global_position, self._place
        if not all(math.isfinite(value) for value in (*self._place, here.lat, here.lon, here.alt)):
            return
        north, east = MapProjection(here.lat, here.lon).project(lat, lon)
        pitch = math.atan2(alt - here.alt, math.hypot(north, east))
        yaw = bearing_rad(here.lat, here.lon, lat, lon)
        roll_offset, pitch_offset, yaw_offset = (value if math.isfinite(value) else 0.0 for value in self._offsets)
        self._locks |= YAW_LOCK
        self._q, self._rates = quaternion(roll_offset, pitch + pitch_offset, yaw + yaw_offset), NAN3
