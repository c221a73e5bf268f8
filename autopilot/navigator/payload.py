"""Mission items about camera, gimbal, gripper and other payload: who is told, and how (PX4: MissionBlock,
Navigator::publish_vehicle_command, v1.18).

What a camera does by itself is sent to it as a command; single images go by the camera trigger, which numbers them.
Everything else stays within the autopilot (topics.navigator_commands), for the camera trigger,
the gimbal manager, the gripper and the commander.
"""

from autopilot.navigator.state import NavigatorState
from autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink

IMAGE_START = mavlink.MAV_CMD_IMAGE_START_CAPTURE
IMAGE_STOP = mavlink.MAV_CMD_IMAGE_STOP_CAPTURE
DO_DIGICAM_CONTROL = mavlink.MAV_CMD_DO_DIGICAM_CONTROL
DO_MOUNT_CONTROL = mavlink.MAV_CMD_DO_MOUNT_CONTROL
GIMBAL_CONFIGURE = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
OF_CAMERA = frozenset(
    {
        IMAGE_START,
        IMAGE_STOP,
        mavlink.MAV_CMD_VIDEO_START_CAPTURE,
        mavlink.MAV_CMD_VIDEO_STOP_CAPTURE,
        mavlink.MAV_CMD_SET_CAMERA_MODE,
        mavlink.MAV_CMD_SET_CAMERA_ZOOM,
        mavlink.MAV_CMD_SET_CAMERA_FOCUS,
        mavlink.MAV_CMD_SET_CAMERA_SOURCE,
    }
)
"""Carried out by the camera, and not by the autopilot."""
WITHIN = frozenset(
    {
        DO_DIGICAM_CONTROL,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL,
        mavlink.MAV_CMD_DO_TRIGGER_CONTROL,
        mavlink.MAV_CMD_DO_MOUNT_CONFIGURE,
        DO_MOUNT_CONTROL,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        GIMBAL_CONFIGURE,
        mavlink.MAV_CMD_DO_SET_ACTUATOR,
        mavlink.MAV_CMD_DO_GRIPPER,
    }
)
PAYLOAD_COMMANDS = OF_CAMERA | WITHIN
RELEASE = -3.0
"""DO_GIMBAL_MANAGER_CONFIGURE: give control back if one has it."""
UNCHANGED = -1.0


class Payload:
    """Gives a mission's payload commands, and knows what must be undone when the mission is left."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._capturing = False
        self._has_gimbal = False

    def issue(self, command: VehicleCommand) -> None:
        """One of PAYLOAD_COMMANDS, as its item gives it."""
        number = command.command
        if number == DO_MOUNT_CONTROL:
            self._acquire_gimbal()
        if number == IMAGE_START and int(command.param3) == 1:
            self._within(VehicleCommand(DO_DIGICAM_CONTROL, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, from_external=False))
        elif number in OF_CAMERA:
            if number in (IMAGE_START, IMAGE_STOP):
                self._capturing = number == IMAGE_START
            self._to_camera(command)
        else:
            self._within(command)

    def stop(self) -> None:
        """The mission is left: end a series of images and give the gimbal back."""
        if self._capturing:
            self._capturing = False
            self._to_camera(VehicleCommand(IMAGE_STOP, 0.0))
        if self._has_gimbal:
            self._has_gimbal = False
            self._within(VehicleCommand(GIMBAL_CONFIGURE, RELEASE, RELEASE, UNCHANGED, UNCHANGED, from_external=False))

    def _acquire_gimbal(self) -> None:
        self._has_gimbal = True
        own = float(self._state.system_id), float(mavlink.MAV_COMP_ID_AUTOPILOT1)
        self._within(VehicleCommand(GIMBAL_CONFIGURE, *own, UNCHANGED, UNCHANGED, from_external=False))

    def _within(self, command: VehicleCommand) -> None:
        self._state.command(command)

    def _to_camera(self, command: VehicleCommand) -> None:
        camera = int(command.param1) if 0.0 < command.param1 < 256.0 else mavlink.MAV_COMP_ID_CAMERA
        system = self._state.system_id
        self._state.outgoing.give(command._replace(target_system=system, target_component=camera, from_external=False))
