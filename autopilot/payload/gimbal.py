"""The gimbal manager: who may point the gimbal, and where it is to look. PX4's modules/gimbal (v1.18).

Runs where MNT_MODE_IN is 0 or above at boot (rcS). MNT_MODE_IN 0 (automatic) and 4 take the MAVLink gimbal protocol v2
(https://mavlink.io/en/services/gimbal_v2.html), 2 regions of interest alone, 3 the old DO_MOUNT commands alone; the
output is a MAVLink gimbal (MNT_MODE_OUT 2), found by asking everybody for GIMBAL_DEVICE_INFORMATION once a second.
Nobody is in primary control until DO_GIMBAL_MANAGER_CONFIGURE says who; there is no secondary control, as in PX4. A
region of interest needs no control.

Left out: sticks and RC (MNT_MODE_IN 1), servos and gimbal protocol v1 (MNT_MODE_OUT 0 and 1), several gimbals.
"""

import math
from typing import ClassVar

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
    GimbalManagerSetAttitude,
    GimbalManagerStatus,
    Quaternion,
    Topics,
    Vector3,
    VehicleCommand,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import quaternion
from sitl_emu.core.geodesy import MapProjection, bearing_rad

AUTOMATIC, RC, ROI, MOUNT, PROTOCOL_V2 = range(5)
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
LOCKS = ROLL_LOCK | PITCH_LOCK | YAW_LOCK
ROI_NONE, ROI_WPNEXT, ROI_LOCATION = 0, 1, 3
WPNEXT_PITCH_RAD = -10.0
"""PX4's fixed pitch for the next waypoint, which it means for radians: below -pi, so the waypoint's height counts."""
UNCHANGED, ITSELF, RELEASE = -1, -2, -3
FORWARD: Quaternion = (1.0, 0.0, 0.0, 0.0)
NO_ATTITUDE: Quaternion = (NAN, NAN, NAN, NAN)
ASK_EVERY_US = 1_000_000
OLD_ANGLE, OLD_RATE, OLD_ABSOLUTE = range(3)
"""DO_MOUNT_CONFIGURE, param5 to 7."""


class Gimbal:
    """Writes gimbal_device_set_attitude and gimbal_manager_status."""

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
        self._control = (0, 0)
        self._flags = 0
        self._q, self._rates = NO_ATTITUDE, NAN3
        self._looks_at: tuple[float, float, float] | None = None
        self._offsets: Vector3 = (0.0, 0.0, 0.0)
        self._fixed_pitch_rad = NAN
        self._roi = topics.vehicle_roi
        self._follows_waypoint = False
        self._set_attitude = topics.gimbal_manager_set_attitude
        self._status = topics.gimbal_device_attitude_status
        self._commands_seen = 0
        self._ask_us = 0

    # --- commands -------------------------------------------------------------------------------------------

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Decide on one of COMMANDS; None gives no ack."""
        number = command.command
        if number in (MOUNT_CONTROL, MOUNT_CONFIGURE):
            if not self._takes_mount:
                return None
            if number == MOUNT_CONTROL:
                self._mount_control(command)
            else:
                self._mount_configure(command)
            return CommandResult(MAV_RESULT_ACCEPTED)
        if not self._takes_v2:
            return None
        source = (command.source_system, command.source_component) if command.from_external else self._itself
        if number == CONFIGURE:
            system = self._controller(command.param1, 0, source[0])
            self._control = (system, self._controller(command.param2, 1, source[1]))
            return CommandResult(MAV_RESULT_ACCEPTED)
        if source != self._control:
            return CommandResult(MAV_RESULT_DENIED)
        q = quaternion(0.0, math.radians(command.param1), math.radians(command.param2))
        flags = int(command.param5) if math.isfinite(command.param5) and command.param5 >= 0.0 else 0
        self._point(flags, q, (0.0, math.radians(command.param3), math.radians(command.param4)))
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

    def _mount_control(self, command: VehicleCommand) -> None:
        mode = int(command.param7) if math.isfinite(command.param7) else -1
        if mode in (mavlink.MAV_MOUNT_MODE_RETRACT, mavlink.MAV_MOUNT_MODE_NEUTRAL):
            self._neutral()
        elif mode == mavlink.MAV_MOUNT_MODE_MAVLINK_TARGETING:
            pitch, roll, yaw = (math.radians(value) for value in command[1:4])
            self._point(ROLL_LOCK | PITCH_LOCK, quaternion(roll, pitch, yaw), NAN3)
        elif mode == mavlink.MAV_MOUNT_MODE_GPS_POINT:
            self._look_at(command.param5, command.param6, command.param4)

    def _mount_configure(self, command: VehicleCommand) -> None:
        kinds = (command.param5, command.param6, command.param7)
        locks = (ROLL_LOCK, PITCH_LOCK, YAW_LOCK)
        self._flags = sum(lock for lock, kind in zip(locks, kinds, strict=True) if nearest(kind) == OLD_ABSOLUTE)

    # --- every cycle ----------------------------------------------------------------------------------------

    def update(self, now_us: int) -> None:
        """At 50 Hz."""
        topics = self._topics
        self._commands_seen = obey_navigator(self, now_us, topics, self._commands_seen)
        if topics.gimbal_manager_set_attitude is not self._set_attitude:
            self._set_attitude = topics.gimbal_manager_set_attitude
            self._take_set_attitude(self._set_attitude)
        if topics.vehicle_roi is not self._roi:
            self._take_roi()
        if self._follows_waypoint:
            current = topics.position_setpoint_triplet.current
            self._looks_at = (current.lat, current.lon, current.alt)
        device = topics.gimbal_device_information.component
        if not device:
            if now_us >= self._ask_us:
                self._ask_us = now_us + ASK_EVERY_US
                ask = VehicleCommand(
                    mavlink.MAV_CMD_REQUEST_MESSAGE,
                    float(mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION),
                    *(0.0,) * 6,
                    from_external=False,
                )
                self._outgoing.give(ask)
            return
        if self._looks_at is not None:
            self._aim(self._looks_at)
        topics.gimbal_device_set_attitude = GimbalDeviceSetAttitude(now_us, device, self._flags, self._q, self._rates)
        if topics.gimbal_device_attitude_status is not self._status:
            self._status = topics.gimbal_device_attitude_status
            topics.gimbal_manager_status = GimbalManagerStatus(
                now_us, self._status.device_flags, device, *self._control
            )

    def _take_set_attitude(self, wanted: GimbalManagerSetAttitude) -> None:
        if not self._takes_v2 or (wanted.origin_sysid, wanted.origin_compid) != self._control:
            return
        rates = wanted.angular_velocity
        if wanted.manual:
            pitch_rate = math.radians(self._parameters["MNT_RATE_PITCH"]) * rates[1]
            rates = (0.0, pitch_rate, math.radians(self._parameters["MNT_RATE_YAW"]) * rates[2])
        self._point(wanted.flags, wanted.q, rates)

    def _take_roi(self) -> None:
        roi = self._roi = self._topics.vehicle_roi
        if not self._takes_roi:
            return
        if roi.mode not in (ROI_NONE, ROI_WPNEXT, ROI_LOCATION):
            return
        self._follows_waypoint = roi.mode == ROI_WPNEXT
        if roi.mode == ROI_LOCATION:
            self._look_at(roi.lat, roi.lon, roi.alt)
        elif roi.mode == ROI_WPNEXT:
            self._offsets = (roi.roll_offset, roi.pitch_offset, roi.yaw_offset)
        else:
            self._neutral()

    # --- where to ---------------------------------------------------------------------------------------------

    def _neutral(self) -> None:
        self._q, self._rates = FORWARD, NAN3
        self._looks_at, self._follows_waypoint = None, False

    def _point(self, flags: int, q: Quaternion, rates: Vector3) -> None:
        if flags & RETRACT:
            return
        if flags & NEUTRAL:
            self._neutral()
            return
        self._flags, self._q, self._rates = flags & LOCKS, q, rates
        self._looks_at, self._follows_waypoint = None, False

    def _look_at(self, lat_deg: float, lon_deg: float, alt_m: float) -> None:
        self._looks_at, self._follows_waypoint = (lat_deg, lon_deg, alt_m), False
        self._offsets = (0.0, 0.0, 0.0)

    def _aim(self, place: tuple[float, float, float]) -> None:
        """From where the vehicle is; yaw against north."""
        here, (lat, lon, alt) = self._topics.vehicle_global_position, place
        if not all(math.isfinite(value) for value in (*place, here.lat, here.lon, here.alt)):
            return
        north, east = MapProjection(here.lat, here.lon).project(lat, lon)
        pitch = math.atan2(alt - here.alt, math.hypot(north, east))
        yaw = bearing_rad(here.lat, here.lon, lat, lon)
        roll_offset, pitch_offset, yaw_offset = self._offsets
        self._flags |= YAW_LOCK
        self._q, self._rates = quaternion(roll_offset, pitch + pitch_offset, yaw + yaw_offset), NAN3
