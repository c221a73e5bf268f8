"""What a companion of one's own is made of: everything that a mission outside this repository imports from us.

A companion is a state machine that is told the time (`Companion` says what it looks like). `Onboard` gives it
telemetry, heartbeats and a pilot's right of way; a `Script` says what comes after what, and hands services to
`Onboard.do`: commands (`arm`, `set_mode`, ...), transfers (`MissionUpload`, `ParameterSet`, ...), setpoints
(`Offboard`); `steps` has what many missions do. `Scripted` makes a whole companion of one script; one with a camera
hands a `Detector`'s finds to a `Spotter`, whose `Confirmation` makes targets of them. `fly` runs it in real
time on a MAVLink link; in a scenario the same program is a `command:`, or a mission's (`sitl_emu.mission`).

The rooms behind these names are free to change; these names stay.
"""

from gcs.camera import Camera
from gcs.command import Command, CommandOutcome, arm, disarm, reposition
from gcs.follow_target import FollowTarget, Target
from gcs.gimbal_manager import GimbalManager
from gcs.manual_control import ManualControl, Sticks
from gcs.message_interval import read_interval, set_interval
from gcs.message_request import MessageRequest
from gcs.mission import MissionClear, MissionDownload, MissionItem, MissionSetCurrent, MissionUpload
from gcs.offboard import Offboard, position_ned, velocity_ned
from gcs.parameter import Parameter, ParameterList, ParameterRead, ParameterSet
from gcs.plan_file import FlightPlan, PlanError, read_plan
from gcs.set_mode import set_mode
from gcs.telemetry import Attitude, Place, Pose, Telemetry
from gcs.timesync import Timesync
from missions.companion import steps
from missions.companion.camera_model import CameraModel, Mount
from missions.companion.companion import (
    AUTOPILOT_LINK,
    GROUND_LINK,
    PEER_LINK,
    Companion,
    Event,
    Outgoing,
    Status,
)
from missions.companion.confirmation import Confirmation, Confirming
from missions.companion.detector import Detection, Detector
from missions.companion.links import LinkError, open_port
from missions.companion.main import Runner
from missions.companion.onboard import Onboard, Script, advanced
from missions.companion.perception import Perception, perception_of
from missions.companion.scripted import Scripted
from missions.companion.spotter import Origin, Spotter
from sitl_emu.core import dialect as mavlink

__all__ = [
    "AUTOPILOT_LINK",
    "GROUND_LINK",
    "PEER_LINK",
    "Attitude",
    "Camera",
    "CameraModel",
    "Command",
    "CommandOutcome",
    "Companion",
    "Confirmation",
    "Confirming",
    "Detection",
    "Detector",
    "Event",
    "FlightPlan",
    "FollowTarget",
    "GimbalManager",
    "LinkError",
    "ManualControl",
    "MessageRequest",
    "MissionClear",
    "MissionDownload",
    "MissionItem",
    "MissionSetCurrent",
    "MissionUpload",
    "Mount",
    "Offboard",
    "Onboard",
    "Origin",
    "Outgoing",
    "Parameter",
    "ParameterList",
    "ParameterRead",
    "ParameterSet",
    "Perception",
    "Place",
    "PlanError",
    "Pose",
    "Runner",
    "Script",
    "Scripted",
    "Spotter",
    "Status",
    "Sticks",
    "Target",
    "Telemetry",
    "Timesync",
    "advanced",
    "arm",
    "disarm",
    "fly",
    "mavlink",
    "open_port",
    "perception_of",
    "position_ned",
    "read_interval",
    "read_plan",
    "reposition",
    "set_interval",
    "set_mode",
    "steps",
    "velocity_ned",
]


def fly(companion: Companion, url: str) -> Status:
    """Run a companion without camera in real time until it is done; how it ended.

    `url` is its autopilot's link: udpin:HOST:PORT, udpout:HOST:PORT or /dev/ttyX[:BAUD]. Raises LinkError if it
    can't be opened. `Runner` takes a peer link, a camera and a log folder as well.
    """
    runner = Runner(companion, {AUTOPILOT_LINK: open_port(url)}, None, None, 0)
    try:
        while not companion.status.done:
            runner.step()
    finally:
        runner.close()
    return companion.status
