"""Mission items about camera, gimbal, gripper and other payload: who is told, and how (PX4: MissionBlock,
Navigator::publish_vehicle_command, v1.18).

What a camera does by itself is sent to it as a command; single images go by the camera trigger, which numbers them.
Before a landing and when a mission is left in flight, the navigator takes the gimbal, turns it forward and gives it
back, so that it is not damaged on the ground.
"""

import math

from sitl_emu.autopilot.commands.table import Role, items_where
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

IMAGE_START = mavlink.MAV_CMD_IMAGE_START_CAPTURE
IMAGE_STOP = mavlink.MAV_CMD_IMAGE_STOP_CAPTURE
DO_DIGICAM_CONTROL = mavlink.MAV_CMD_DO_DIGICAM_CONTROL
DO_MOUNT_CONTROL = mavlink.MAV_CMD_DO_MOUNT_CONTROL
DO_TRIGGER_CONTROL = mavlink.MAV_CMD_DO_TRIGGER_CONTROL
GIMBAL_CONFIGURE = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
GIMBAL_PITCHYAW = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
CHOOSES_CAMERA = frozenset(
    {IMAGE_START, IMAGE_STOP, mavlink.MAV_CMD_SET_CAMERA_MODE, mavlink.MAV_CMD_SET_CAMERA_SOURCE}
)
"""param1 is the camera's component; a single image's is 0 by then, as the trigger's command has no camera."""
VIDEO = frozenset({mavlink.MAV_CMD_VIDEO_START_CAPTURE, mavlink.MAV_CMD_VIDEO_STOP_CAPTURE})
PAYLOAD_COMMANDS = items_where(lambda item: item.role is Role.PAYLOAD)
RELEASE = -3.0
"""DO_GIMBAL_MANAGER_CONFIGURE: give control back if one has it."""
UNCHANGED = -1.0
CENTRE_DELAY_US = 250_000
"""Navigator::neutralize_gimbal_if_control_activated: the flight task that had the gimbal gives it back before."""


class Payload:
    """Gives payload commands, and knows what must be undone when a mission is left."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._capturing = False

    def issue(self, command: VehicleCommand) -> None:
        """One of PAYLOAD_COMMANDS, as its item gives it."""
        number, camera = command.command, 0
        if number == DO_MOUNT_CONTROL:
            self._acquire_gimbal()
        if number == IMAGE_START and truncated(command.param3) == 1:
            command = command_of(DO_DIGICAM_CONTROL, 0.0, 0.0, 0.0, 0.0, 1.0)
        elif number in (IMAGE_START, IMAGE_STOP):
            self._capturing = number == IMAGE_START
        if number in CHOOSES_CAMERA:
            asked = truncated(command.param1)
            camera = asked if 0 < asked < 256 else mavlink.MAV_COMP_ID_CAMERA
        elif number in VIDEO:
            camera = mavlink.MAV_COMP_ID_CAMERA
        self._state.command(command, camera)

    def leave_mission(self) -> None:
        """The mission is left: pause the camera trigger, end a series of images, centre the gimbal if it flies."""
        self._state.command(command_of(DO_TRIGGER_CONTROL, -1.0, 0.0, 1.0))
        if self._capturing:
            self.issue(command_of(IMAGE_STOP))
        if not self._state.landed:
            self._state.centre_gimbal()

    def update(self) -> None:
        """Centre the gimbal when its time has come."""
        state = self._state
        asked_us = state.gimbal_asked_us
        if asked_us is None or state.now_us - asked_us <= CENTRE_DELAY_US:
            return
        state.gimbal_asked_us = None
        self._acquire_gimbal()
        state.command(command_of(GIMBAL_PITCHYAW, *(math.nan,) * 4, float(mavlink.GIMBAL_MANAGER_FLAGS_NEUTRAL)))
        state.command(command_of(GIMBAL_CONFIGURE, RELEASE, RELEASE, UNCHANGED, UNCHANGED))

    def _acquire_gimbal(self) -> None:
        own = float(self._state.system_id), float(mavlink.MAV_COMP_ID_AUTOPILOT1)
        self._state.command(command_of(GIMBAL_CONFIGURE, *own, UNCHANGED, UNCHANGED))


def command_of(number: int, *params: float) -> VehicleCommand:
    """A command of the navigator; parameters that are not given are 0, as in PX4's empty vehicle_command."""
    first, second, third, fourth, fifth, sixth, seventh = params + (0.0,) * (7 - len(params))
    return VehicleCommand(number, first, second, third, fourth, fifth, sixth, seventh, from_external=False)
