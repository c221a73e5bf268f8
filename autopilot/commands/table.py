"""The commands that PX4 v1.18 knows: one row for each MAV_CMD, from which follows who answers it and what a plan keeps.

A new command is a row here and its owner's handler. In PX4 this is spread over mavlink_command_params.hpp (which
parameters are used), mavlink_mission.cpp (items), the navigator (what an item does) and the modules that answer.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto

from sitl_emu.core import dialect as mavlink

P1, P2, P3, P4, P5, P6, P7 = (1 << number for number in range(7))
P12, P123, P1234, PLACE = P1 | P2, P1 | P2 | P3, P1 | P2 | P3 | P4, P5 | P6 | P7
ALL = P1234 | PLACE
"""Sets of a command's seven parameters."""
ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED
NO_ACK = None
"""PX4 sends none: somebody else on the network is expected to answer."""
MISSION: int = mavlink.MAV_MISSION_TYPE_MISSION
FENCE: int = mavlink.MAV_MISSION_TYPE_FENCE
RALLY: int = mavlink.MAV_MISSION_TYPE_RALLY
CUSTOM_0, CUSTOM_1, CUSTOM_2 = range(3)
"""PX4's VEHICLE_CMD_CUSTOM_*, which are no MAV_CMD."""


class Owner(Enum):
    """The module that decides on a command. Some run on some vehicles alone."""

    COMMANDER = auto()
    ESTIMATOR = auto()
    FAILURE_INJECTION = auto()
    PAYLOAD_DELIVERER = auto()
    ACTUATOR_GROUP_TEST = auto()
    AUTOTUNE = auto()
    CAMERA_TRIGGER = auto()
    GIMBAL = auto()
    MESSAGE_REQUEST = auto()
    MESSAGE_INTERVAL = auto()
    LOG_STREAMING = auto()


class Role(Enum):
    """What the navigator does with an item of a mission."""

    PLACE = auto()
    """It is flown to."""
    GATE = auto()
    """A plane that is passed on the way to the next place."""
    ROI = auto()
    PAYLOAD = auto()
    """Told to camera, gimbal, gripper or actuators (navigator/payload.py)."""
    CARRIED_OUT = auto()
    """By the mission itself."""
    PASSED_OVER = auto()
    """Told to others at most."""


@dataclass(frozen=True, slots=True)
class Item:
    """How a command stands in a plan.

    MavlinkMissionManager::parse_mavlink_mission_item and format_mavlink_mission_item, FeasibilityChecker.
    """

    role: Role
    keeps: int | None = None
    """Parameters that are kept in global frames; None: it is not taken in these."""
    in_mission_frame: bool = False
    """It is taken in MAV_FRAME_MISSION, with all its parameters."""
    before_takeoff: bool = False
    """It may come before a takeoff."""
    feasible: bool = True
    """A mission may have it; else it is taken when uploaded, and refused by the check."""
    heading: bool = False
    """param4 is one, kept within 0 and 360 degrees."""
    comes_back: bool = True
    """Its parameters are sent back from a global frame; else PX4 carries it out with them, and sends zeros."""
    plan: int = MISSION
    """MAV_MISSION_TYPE of the plan that it belongs to."""


@dataclass(frozen=True, slots=True)
class Command:
    """What PX4 knows of a command."""

    params: int = ALL
    """Those that may be set in a COMMAND_LONG or COMMAND_INT; what sets another is refused."""
    in_plan: int | None = None
    """Those that may be set in a plan, where they are others."""
    scaled: bool = False
    """A COMMAND_INT's x and y are scaled; they are a place, or DO_SET_ACTUATOR's."""
    owner: Owner | None = None
    acts: bool = True
    """Something happens; else the owner only answers, as PX4 does on our vehicles."""
    otherwise: int | None = UNSUPPORTED
    """MAV_RESULT of the answer where no owner runs, or NO_ACK."""
    item: Item | None = None


PAYLOAD_ITEM = Item(Role.PAYLOAD, in_mission_frame=True, before_takeoff=True)
ROI_ITEM = Item(Role.ROI, in_mission_frame=True, before_takeoff=True)
CARRIED_OUT_ITEM = Item(Role.CARRIED_OUT, in_mission_frame=True, before_takeoff=True)
PASSED_OVER_ITEM = Item(Role.PASSED_OVER, in_mission_frame=True, before_takeoff=True)
FENCE_ZONE = Item(Role.PASSED_OVER, keeps=P1, feasible=False, plan=FENCE)
COMMANDS: Mapping[int, Command] = {
    CUSTOM_0: Command(otherwise=NO_ACK),
    CUSTOM_1: Command(otherwise=NO_ACK),
    CUSTOM_2: Command(otherwise=NO_ACK),
    mavlink.MAV_CMD_NAV_WAYPOINT: Command(P12 | P4 | PLACE, item=Item(Role.PLACE, keeps=P12 | P4, heading=True)),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: Command(P3 | P4 | PLACE, item=Item(Role.PLACE, keeps=P3 | P4, heading=True)),
    mavlink.MAV_CMD_NAV_LOITER_TIME: Command(item=Item(Role.PLACE, keeps=P1234)),
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: Command(
        0, owner=Owner.COMMANDER, item=Item(Role.CARRIED_OUT, in_mission_frame=True)
    ),
    mavlink.MAV_CMD_NAV_LAND: Command(
        P12 | P4 | PLACE, scaled=True, owner=Owner.COMMANDER, item=Item(Role.PLACE, keeps=P12 | P4, heading=True)
    ),
    mavlink.MAV_CMD_NAV_TAKEOFF: Command(
        P1 | P4 | PLACE, scaled=True, owner=Owner.COMMANDER, item=Item(Role.PLACE, keeps=P4, heading=True)
    ),
    mavlink.MAV_CMD_NAV_LAND_LOCAL: Command(scaled=True, owner=Owner.COMMANDER),
    mavlink.MAV_CMD_NAV_LOITER_TO_ALT: Command(P12 | P4 | PLACE, item=Item(Role.PLACE, keeps=P12 | P4)),
    mavlink.MAV_CMD_DO_ORBIT: Command(scaled=True, owner=Owner.COMMANDER),
    mavlink.MAV_CMD_DO_FIGURE_EIGHT: Command(scaled=True, owner=Owner.COMMANDER, acts=False),
    mavlink.MAV_CMD_NAV_ROI: Command(
        P123 | PLACE,
        scaled=True,
        owner=Owner.COMMANDER,
        item=Item(Role.ROI, keeps=P1, in_mission_frame=True, feasible=False),
    ),
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: Command(
        P3 | P4 | PLACE,
        scaled=True,
        owner=Owner.COMMANDER,
        in_plan=P4 | PLACE,
        item=Item(Role.PLACE, keeps=P4, heading=True),
    ),
    mavlink.MAV_CMD_NAV_VTOL_LAND: Command(
        in_plan=P3 | P4 | PLACE,
        item=Item(Role.PLACE, keeps=P4, heading=True),
    ),
    mavlink.MAV_CMD_NAV_DELAY: Command(P1234, otherwise=NO_ACK, item=CARRIED_OUT_ITEM),
    mavlink.MAV_CMD_CONDITION_DELAY: Command(P1, item=Item(Role.CARRIED_OUT, in_mission_frame=True, feasible=False)),
    mavlink.MAV_CMD_CONDITION_DISTANCE: Command(P1),
    mavlink.MAV_CMD_DO_SET_MODE: Command(P123, owner=Owner.COMMANDER),
    mavlink.MAV_CMD_DO_JUMP: Command(P12, item=CARRIED_OUT_ITEM),
    mavlink.MAV_CMD_DO_CHANGE_SPEED: Command(P123, owner=Owner.COMMANDER, item=CARRIED_OUT_ITEM),
    mavlink.MAV_CMD_DO_SET_HOME: Command(scaled=True, owner=Owner.COMMANDER, item=CARRIED_OUT_ITEM),
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_DO_CHANGE_ALTITUDE: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_DO_SET_ACTUATOR: Command(
        scaled=True, owner=Owner.COMMANDER, item=Item(Role.PAYLOAD, in_mission_frame=True)
    ),
    mavlink.MAV_CMD_DO_LAND_START: Command(PLACE, scaled=True, owner=Owner.COMMANDER, item=PASSED_OVER_ITEM),
    mavlink.MAV_CMD_DO_GO_AROUND: Command(otherwise=ACCEPTED),
    mavlink.MAV_CMD_DO_REPOSITION: Command(scaled=True, owner=Owner.COMMANDER),
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION: Command(
        P1 | PLACE, scaled=True, owner=Owner.COMMANDER, in_plan=PLACE, item=Item(Role.ROI, keeps=0, before_takeoff=True)
    ),
    mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: Command(P1, owner=Owner.COMMANDER, item=ROI_ITEM),
    mavlink.MAV_CMD_DO_SET_ROI_NONE: Command(P1, owner=Owner.COMMANDER, item=ROI_ITEM),
    mavlink.MAV_CMD_DO_CONTROL_VIDEO: Command(item=PASSED_OVER_ITEM),
    mavlink.MAV_CMD_DO_SET_ROI: Command(
        P123,
        scaled=True,
        owner=Owner.COMMANDER,
        item=Item(Role.ROI, keeps=P1, in_mission_frame=True, before_takeoff=True, comes_back=False),
    ),
    mavlink.MAV_CMD_DO_DIGICAM_CONTROL: Command(owner=Owner.CAMERA_TRIGGER, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_DO_MOUNT_CONFIGURE: Command(owner=Owner.GIMBAL, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_DO_MOUNT_CONTROL: Command(owner=Owner.GIMBAL, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST: Command(
        P1234, owner=Owner.CAMERA_TRIGGER, otherwise=NO_ACK, item=PAYLOAD_ITEM
    ),
    mavlink.MAV_CMD_DO_GRIPPER: Command(
        P12, owner=Owner.PAYLOAD_DELIVERER, item=Item(Role.PAYLOAD, in_mission_frame=True)
    ),
    mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE: Command(
        P12, owner=Owner.AUTOTUNE, item=Item(Role.CARRIED_OUT, keeps=P12, in_mission_frame=True, comes_back=False)
    ),
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: Command(
        P123, owner=Owner.CAMERA_TRIGGER, otherwise=NO_ACK, item=PAYLOAD_ITEM
    ),
    mavlink.MAV_CMD_DO_MOUNT_CONTROL_QUAT: Command(otherwise=NO_ACK),
    mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_PREFLIGHT_SET_SENSOR_OFFSETS: Command(otherwise=NO_ACK),
    mavlink.MAV_CMD_PREFLIGHT_UAVCAN: Command(otherwise=NO_ACK),
    mavlink.MAV_CMD_PREFLIGHT_STORAGE: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_OBLIQUE_SURVEY: Command(owner=Owner.CAMERA_TRIGGER, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_MISSION_START: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_ACTUATOR_GROUP_TEST: Command(owner=Owner.ACTUATOR_GROUP_TEST, otherwise=NO_ACK),
    mavlink.MAV_CMD_ACTUATOR_TEST: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_CONFIGURE_ACTUATOR: Command(otherwise=NO_ACK),
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: Command(
        P12, owner=Owner.COMMANDER, item=Item(Role.CARRIED_OUT, keeps=P1, in_mission_frame=True, comes_back=False)
    ),
    mavlink.MAV_CMD_RUN_PREARM_CHECKS: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_INJECT_FAILURE: Command(P123, owner=Owner.FAILURE_INJECTION),
    mavlink.MAV_CMD_START_RX_PAIR: Command(otherwise=NO_ACK),
    mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: Command(owner=Owner.MESSAGE_INTERVAL),
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: Command(owner=Owner.MESSAGE_INTERVAL),
    mavlink.MAV_CMD_REQUEST_MESSAGE: Command(owner=Owner.MESSAGE_REQUEST),
    mavlink.MAV_CMD_REQUEST_CAMERA_INFORMATION: Command(otherwise=NO_ACK),
    mavlink.MAV_CMD_SET_CAMERA_MODE: Command(P12, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_SET_CAMERA_ZOOM: Command(otherwise=NO_ACK, item=Item(Role.PAYLOAD, before_takeoff=True)),
    mavlink.MAV_CMD_SET_CAMERA_FOCUS: Command(P123, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_SET_CAMERA_SOURCE: Command(P123, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN: Command(PLACE, in_plan=0, scaled=True, owner=Owner.ESTIMATOR),
    mavlink.MAV_CMD_EXTERNAL_ATTITUDE_ESTIMATE: Command(owner=Owner.ESTIMATOR),
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: Command(owner=Owner.GIMBAL, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: Command(owner=Owner.GIMBAL, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_IMAGE_START_CAPTURE: Command(P1234, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: Command(P1, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_DO_TRIGGER_CONTROL: Command(P1234, owner=Owner.CAMERA_TRIGGER, otherwise=NO_ACK, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_VIDEO_START_CAPTURE: Command(P123, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: Command(P12, item=PAYLOAD_ITEM),
    mavlink.MAV_CMD_LOGGING_START: Command(owner=Owner.LOG_STREAMING),
    mavlink.MAV_CMD_LOGGING_STOP: Command(owner=Owner.LOG_STREAMING),
    mavlink.MAV_CMD_CONTROL_HIGH_LATENCY: Command(owner=Owner.COMMANDER, acts=False),
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: Command(P12, otherwise=NO_ACK, item=PASSED_OVER_ITEM),
    mavlink.MAV_CMD_CONDITION_GATE: Command(0, item=Item(Role.GATE, keeps=0)),
    mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT: Command(
        0, in_plan=PLACE, item=Item(Role.PASSED_OVER, keeps=0, feasible=False)
    ),
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: Command(P1, in_plan=P1 | P5 | P6, item=FENCE_ZONE),
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: Command(P1, in_plan=P1 | P5 | P6, item=FENCE_ZONE),
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: Command(P1, in_plan=P1 | P5 | P6, item=FENCE_ZONE),
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: Command(P1, in_plan=P1 | P5 | P6, item=FENCE_ZONE),
    mavlink.MAV_CMD_NAV_RALLY_POINT: Command(
        0, in_plan=PLACE, item=Item(Role.PASSED_OVER, keeps=0, feasible=False, plan=RALLY)
    ),
    mavlink.MAV_CMD_DO_SET_SAFETY_SWITCH_STATE: Command(owner=Owner.COMMANDER, acts=False),
    mavlink.MAV_CMD_PAYLOAD_PREPARE_DEPLOY: Command(scaled=True, otherwise=NO_ACK),
    mavlink.MAV_CMD_PAYLOAD_CONTROL_DEPLOY: Command(otherwise=NO_ACK),
    mavlink.MAV_CMD_FIXED_MAG_CAL_YAW: Command(owner=Owner.COMMANDER),
    mavlink.MAV_CMD_DO_WINCH: Command(P1234, otherwise=NO_ACK, item=Item(Role.PASSED_OVER, in_mission_frame=True)),
    mavlink.MAV_CMD_GUIDED_CHANGE_HEADING: Command(owner=Owner.COMMANDER, acts=False),
    mavlink.MAV_CMD_EXTERNAL_POSITION_ESTIMATE: Command(scaled=True, owner=Owner.ESTIMATOR),
    mavlink.MAV_CMD_EXTERNAL_WIND_ESTIMATE: Command(owner=Owner.ESTIMATOR),
    mavlink.MAV_CMD_ESTIMATOR_SENSOR_ENABLE: Command(owner=Owner.ESTIMATOR),
}
UNKNOWN = Command()
"""A command of which PX4 knows nothing: all its parameters may be set, and it is UNSUPPORTED."""


def commands_of(owner: Owner) -> frozenset[int]:
    """The commands that a module decides on."""
    return frozenset(number for number, command in COMMANDS.items() if command.owner is owner)


def items_where(condition: Callable[[Item], bool]) -> frozenset[int]:
    """The commands that may stand in a plan and whose items fulfil a condition."""
    return frozenset(number for number, command in COMMANDS.items() if command.item and condition(command.item))


FIXED = {number: command.otherwise for number, command in COMMANDS.items() if command.otherwise != UNSUPPORTED}
"""What the commander answers where nobody else does: a MAV_RESULT, or no ack (None)."""
