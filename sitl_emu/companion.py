"""What a companion of one's own is made of: everything that a mission outside this repository imports from us.

A companion is a state machine that is told the time (`Companion` says what it looks like). `Onboard` gives it
telemetry, heartbeats and a pilot's right of way; a `Script` says what comes after what, and hands services to
`Onboard.do`: commands (`arm`, `set_mode`, ...), transfers (`MissionUpload`, `ParameterSet`, ...), setpoints
(`Offboard`); `steps` has what many missions do. `Scripted` makes a whole companion of one script; one with a camera
hands a `Detector`'s finds to a `Spotter`, whose `Confirmation` makes targets of them. `fly` runs it in real
time on a MAVLink link; in a scenario the same program is a `command:`, or a mission's (`sitl_emu.mission`).

The rooms behind these names are free to change; these names stay.
"""

from collections.abc import Sequence

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.camera import Camera
from sitl_emu.gcs.command import Command, CommandOutcome, arm, disarm, reposition
from sitl_emu.gcs.follow_target import FollowTarget, Target
from sitl_emu.gcs.gimbal_manager import GimbalManager
from sitl_emu.gcs.manual_control import ManualControl, Sticks
from sitl_emu.gcs.message_interval import read_interval, set_interval
from sitl_emu.gcs.message_request import MessageRequest
from sitl_emu.gcs.mission import MissionClear, MissionDownload, MissionItem, MissionSetCurrent, MissionUpload
from sitl_emu.gcs.offboard import Offboard, position_ned, velocity_ned
from sitl_emu.gcs.parameter import Parameter, ParameterList, ParameterRead, ParameterSet
from sitl_emu.gcs.plan_file import FlightPlan, PlanError, read_plan
from sitl_emu.gcs.set_mode import set_mode
from sitl_emu.gcs.telemetry import Attitude, Place, Pose, Telemetry
from sitl_emu.gcs.timesync import Timesync
from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.camera_model import CameraModel, Mount, body_points, camera_pose, depth_points
from sitl_emu.missions.companion.companion import (
    AUTOPILOT_LINK,
    PEER_LINK,
    Companion,
    Event,
    Outgoing,
    Status,
)
from sitl_emu.missions.companion.confirmation import Confirmation, Confirming
from sitl_emu.missions.companion.detector import Detection, Detector
from sitl_emu.missions.companion.feeds import Cloud, Depth, Feed, FeedError, open_feed
from sitl_emu.missions.companion.links import LinkError, open_port
from sitl_emu.missions.companion.main import Runner
from sitl_emu.missions.companion.onboard import Onboard, Script, advanced
from sitl_emu.missions.companion.perception import Perception, perception_of
from sitl_emu.missions.companion.scripted import Scripted
from sitl_emu.missions.companion.spotter import Origin, Spotter

__all__ = [
    "AUTOPILOT_LINK",
    "PEER_LINK",
    "Attitude",
    "Camera",
    "CameraModel",
    "Cloud",
    "Command",
    "CommandOutcome",
    "Companion",
    "Confirmation",
    "Confirming",
    "Depth",
    "Detection",
    "Detector",
    "Event",
    "Feed",
    "FeedError",
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
    "body_points",
    "camera_pose",
    "depth_points",
    "disarm",
    "fly",
    "mavlink",
    "open_feed",
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


def fly(companion: Companion, url: str, feeds: Sequence[str] = ()) -> Status:
    """Run a companion without camera in real time until it is done; how it ended.

    `url` is its autopilot's link: udpin:HOST:PORT, udpout:HOST:PORT or /dev/ttyX[:BAUD]. `feeds`: those of a depth
    camera and of a lidar, shm:NAME. Raises LinkError and FeedError if one can't be opened. `Runner` takes a peer link,
    a camera and a log folder as well.
    """
    opened = [open_feed(feed) for feed in feeds]
    runner = Runner(companion, {AUTOPILOT_LINK: open_port(url)}, None, None, 0, opened)
    try:
        while not companion.status.done:
            runner.step()
    finally:
        runner.close()
    return companion.status
