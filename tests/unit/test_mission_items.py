"""Which commands a plan may hold, and which of their parameters are kept: PX4's lists, written out by name.

They are the cases of MavlinkMissionManager::parse_mavlink_mission_item (mavlink_mission.cpp, v1.18).
"""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.mavlink.services.mission_items import parse
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.unit.plan_messages import MISSION_FRAME, RELATIVE_INT, item

ACCEPTED, ERROR = 0, 1
MISSION, FENCE, RALLY = 0, 1, 2
LAST_COMMAND = 50_000
NOT_GIVEN = 0x7FFFFFFF
KEPT_IN_GLOBAL_FRAMES = {
    "NAV_WAYPOINT": "124",
    "NAV_LOITER_UNLIM": "34",
    "NAV_LOITER_TIME": "1234",
    "NAV_LAND": "124",
    "NAV_TAKEOFF": "4",
    "NAV_LOITER_TO_ALT": "124",
    "NAV_ROI": "1",
    "DO_SET_ROI": "1",
    "DO_SET_ROI_LOCATION": "",
    "NAV_VTOL_TAKEOFF": "4",
    "NAV_VTOL_LAND": "4",
    "CONDITION_GATE": "",
    "NAV_FENCE_RETURN_POINT": "",
    "NAV_FENCE_POLYGON_VERTEX_INCLUSION": "1",
    "NAV_FENCE_POLYGON_VERTEX_EXCLUSION": "1",
    "NAV_FENCE_CIRCLE_INCLUSION": "1",
    "NAV_FENCE_CIRCLE_EXCLUSION": "1",
    "NAV_RALLY_POINT": "",
    "COMPONENT_ARM_DISARM": "1",
    "DO_AUTOTUNE_ENABLE": "12",
}
"""Commands, and the numbers of the parameters that are kept."""
# fmt: off
TAKEN_IN_MISSION_FRAME = {
    "DO_JUMP", "NAV_ROI", "DO_SET_ROI", "DO_WINCH", "DO_GRIPPER", "DO_CHANGE_SPEED", "DO_SET_HOME", "DO_LAND_START",
    "DO_TRIGGER_CONTROL", "DO_DIGICAM_CONTROL", "DO_MOUNT_CONFIGURE", "DO_MOUNT_CONTROL", "IMAGE_START_CAPTURE",
    "IMAGE_STOP_CAPTURE", "VIDEO_START_CAPTURE", "VIDEO_STOP_CAPTURE", "DO_CONTROL_VIDEO", "DO_SET_CAM_TRIGG_DIST",
    "OBLIQUE_SURVEY", "DO_SET_CAM_TRIGG_INTERVAL", "SET_CAMERA_MODE", "SET_CAMERA_SOURCE", "DO_VTOL_TRANSITION",
    "NAV_DELAY", "NAV_RETURN_TO_LAUNCH", "DO_SET_ROI_WPNEXT_OFFSET", "DO_SET_ROI_NONE", "DO_SET_ACTUATOR",
    "DO_AUTOTUNE_ENABLE", "COMPONENT_ARM_DISARM", "CONDITION_DELAY", "SET_CAMERA_FOCUS",
    "DO_GIMBAL_MANAGER_PITCHYAW", "DO_GIMBAL_MANAGER_CONFIGURE",
}
# fmt: on


def number(name: str) -> int:
    return int(getattr(mavlink, f"MAV_CMD_{name}"))


def parsed(command: int, frame: int, kind: int = MISSION, **params: float) -> tuple[MissionItem | None, int]:
    """The item, sent with as much of a place as the command has."""
    for place in ({}, {"z": 0.0}, {"x": NOT_GIVEN, "y": NOT_GIVEN, "z": 0.0}):
        found, result = parse(item(0, command, frame, **params, **place), kind, VehicleKind.MULTICOPTER.traits)
        if result in (ACCEPTED, ERROR):
            break
    return found, result


def taken(frame: int) -> set[int]:
    """All commands that are accepted, or refused because another plan holds them."""
    return {command for command in range(LAST_COMMAND + 1) if parsed(command, frame)[1] in (ACCEPTED, ERROR)}


def test_commands_with_a_place() -> None:
    assert taken(RELATIVE_INT) == {number(name) for name in KEPT_IN_GLOBAL_FRAMES}


def test_commands_without_a_place() -> None:
    assert taken(MISSION_FRAME) == {number(name) for name in TAKEN_IN_MISSION_FRAME}


def plan_of(command: int) -> int:
    """The kind of plan that a command belongs to."""
    return RALLY if command == number("NAV_RALLY_POINT") else FENCE if 5000 <= command < 5100 else MISSION


@pytest.mark.parametrize("name", KEPT_IN_GLOBAL_FRAMES)
def test_kept_parameters(name: str) -> None:
    command, kept = number(name), ""
    for which in "1234":
        # at least three vertices, whichever parameter is asked for
        params = {"param1": 3.0 if name.startswith("NAV_FENCE_POLYGON") else 0.0, f"param{which}": 3.0}
        found, _ = parsed(command, RELATIVE_INT, plan_of(command), **params)
        if found is not None and getattr(found, f"param{which}") != 0.0:
            kept += which
    assert kept == KEPT_IN_GLOBAL_FRAMES[name]


def test_a_condition_of_time_becomes_a_delay() -> None:
    found, _ = parsed(number("CONDITION_DELAY"), MISSION_FRAME, param1=5.0)
    assert found is not None
    assert (found.command, found.param1) == (number("NAV_DELAY"), 5.0)


@pytest.mark.parametrize(("name", "flags"), [("NAV_LOITER_TIME", (0, 1, 0, 1)), ("NAV_LOITER_TO_ALT", (1, 0, 0, 1))])
def test_who_circles_keeps_flags_and_no_heading(name: str, flags: tuple[int, ...]) -> None:
    params: dict[str, Any] = {f"param{place}": 90.0 for place, flag in enumerate(flags, start=1) if flag}
    found, _ = parsed(number(name), RELATIVE_INT, **params)
    assert found is not None
    assert (found.param1, found.param2, found.param3, found.param4) == flags


def test_the_height_of_an_approach_may_be_told_and_is_not_kept() -> None:
    """QGroundControl sets param3 of NAV_VTOL_LAND (mavlink_command_params.hpp)."""
    found, result = parsed(number("NAV_VTOL_LAND"), RELATIVE_INT, param3=40.0, param4=90.0)
    assert result == ACCEPTED
    assert found is not None
    assert (found.param3, found.param4) == (0.0, 90.0)


@pytest.mark.parametrize(("name", "kept"), [("NAV_WAYPOINT", 30.0), ("NAV_LAND", 30.0), ("NAV_TAKEOFF", 0.0)])
def test_a_fence_keeps_the_number_of_other_items_that_lies_where_a_circles_radius_does(name: str, kept: float) -> None:
    """The union of mission_item_s (src/modules/navigator/navigation.h)."""
    found, _ = parsed(number(name), RELATIVE_INT, FENCE, param1=30.0)
    assert found is not None
    assert found.param1 == kept


@pytest.mark.parametrize(
    ("asked", "kept"),
    [(-90.0, 270.0), (400.0, 39.9999886), (1.0, 0.99999994), (math.nan, math.nan), (math.inf, math.nan)],
)
def test_a_heading_is_kept_within_a_turn(asked: float, kept: float) -> None:
    """In radians, as a float32."""
    found, _ = parsed(number("NAV_WAYPOINT"), RELATIVE_INT, param4=asked)
    assert found is not None
    assert found.param4 == pytest.approx(kept, rel=1e-8, nan_ok=True)
