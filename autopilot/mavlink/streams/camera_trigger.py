"""CAMERA_TRIGGER: an image is wanted, for which it asks the cameras on the link (PX4: streams/CAMERA_TRIGGER.hpp).

Six cameras, whether they are there or not, each by IMAGE_START_CAPTURE with the link's next sequence number and by
DO_DIGICAM_CONTROL, which goes to the system of the camera that was heard last (0: there was none) and is not repeated.
"""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.topics import NAN, VehicleCommand
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_CAMERA_TRIGGER
IMAGE_START_CAPTURE: Final[int] = mavlink.MAV_CMD_IMAGE_START_CAPTURE
DO_DIGICAM_CONTROL: Final[int] = mavlink.MAV_CMD_DO_DIGICAM_CONTROL
FIRST_CAMERA: Final[int] = mavlink.MAV_COMP_ID_CAMERA
CAMERAS: Final = 6


def stamp(now_us: int, context: Context) -> int:
    """Once per image."""
    return context.topics.camera_trigger.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before the first image."""
    trigger = context.topics.camera_trigger
    return (trigger.timestamp, trigger.seq) if trigger.timestamp else None


def sent(now_us: int, context: Context, link: Link, count: int) -> None:
    """The commands that go with the message, `count` images after the link's first."""
    digicam_system = context.topics.camera_status.active_sys_id
    for number in range(CAMERAS):
        camera, sequence = FIRST_CAMERA + number, float(count * CAMERAS + number + 1)
        if context.send_command is not None:
            take_one = (IMAGE_START_CAPTURE, 0.0, 0.0, 1.0, sequence, NAN, NAN, NAN)
            command = VehicleCommand(
                *take_one, target_system=context.system_id, target_component=camera, from_external=False
            )
            context.send_command(now_us, command, link)
        shoot = (NAN, NAN, NAN, NAN, 1.0, NAN, NAN)
        link.send_fields(mavlink.MAVLINK_MSG_ID_COMMAND_LONG, *shoot, DO_DIGICAM_CONTROL, digicam_system, camera, 0)
