"""A mission that is left and goes on: from where, and what is said again; after PX4's MissionBase."""

import math

import pytest

from sitl_emu.autopilot.navigator.mission_resume import MissionResume, takes_pictures
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.core import dialect as mavlink

from .navigation_fake import FakeVehicle, item

TAKEOFF, WAYPOINT = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_WAYPOINT
CAMERA_MODE, GIMBAL = mavlink.MAV_CMD_SET_CAMERA_MODE, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
DISTANCE, TRIGGER = mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST, mavlink.MAV_CMD_DO_TRIGGER_CONTROL
START, STOP = mavlink.MAV_CMD_IMAGE_START_CAPTURE, mavlink.MAV_CMD_IMAGE_STOP_CAPTURE
SPEED = mavlink.MAV_CMD_DO_CHANGE_SPEED


def survey(*trigger: float) -> tuple[MissionItem, ...]:
    """Camera and gimbal set, pictures from the first place on, a turn of 90 degrees at the second."""
    return (
        item(TAKEOFF, 0, 0, 8), item(CAMERA_MODE), item(GIMBAL, 0, 0, 0, -45.0), item(SPEED, 0, 0, 0, 1.0, 4.0),
        item(WAYPOINT, 60, 0, 8), item(DISTANCE, 0, 0, 0, *trigger), item(WAYPOINT, 120, 0, 8),
        item(WAYPOINT, 120, 90, 8), item(WAYPOINT, 60, 90, 8),
    )  # fmt: skip


def flying_between_third_and_fourth(*trigger: float) -> FakeVehicle:
    vehicle = FakeVehicle(NAV_ACC_RAD=2.0)
    vehicle.run(3.0)
    vehicle.upload(*survey(*trigger))
    vehicle.run(0.1)
    assert vehicle.set_mode(4, 4) == 0
    assert vehicle.arm() == 0
    for _ in range(3000):
        vehicle.step()
        if vehicle.topics.mission_result.seq_reached == 6:
            break
    vehicle.run(6.0)
    assert vehicle.topics.mission_result.seq_current == 7
    assert vehicle.set_mode(4, 3) == 0
    vehicle.run(3.0)
    return vehicle


def said(vehicle: FakeVehicle, since: int) -> list[int]:
    """Commands of the navigator behind a record's number."""
    return [record.command.command for record in vehicle.topics.navigator_commands if record.number > since]


def last_number(vehicle: FakeVehicle) -> int:
    return vehicle.topics.navigator_commands[-1].number


def test_it_goes_back_a_place_turns_and_takes_pictures_again() -> None:
    vehicle = flying_between_third_and_fourth(25.0)
    since = last_number(vehicle)
    vehicle.heading_is_good = False  # the fake never turns
    assert vehicle.set_mode(4, 4) == 0
    vehicle.run(0.2)
    assert vehicle.topics.mission_result.seq_current == 6
    assert said(vehicle, since)[:2] == [CAMERA_MODE, GIMBAL]
    assert DISTANCE not in said(vehicle, since)
    while vehicle.east > 3.0:
        vehicle.step()
    vehicle.run(1.0)
    assert vehicle.topics.mission_result.seq_current == 7
    assert said(vehicle, since).count(DISTANCE) == 1
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == 4.0


def test_it_looks_along_the_leg_before_it_flies_it() -> None:
    vehicle = flying_between_third_and_fourth(25.0)
    assert vehicle.set_mode(4, 4) == 0
    while vehicle.east > 2.5:
        vehicle.step()
    vehicle.run(1.0)
    assert vehicle.topics.mission_result.seq_current == 6  # the fake looks north and never turns
    assert vehicle.topics.position_setpoint_triplet.current.yaw == pytest.approx(math.pi / 2.0, abs=0.01)


def test_without_pictures_it_goes_on_where_it_was() -> None:
    vehicle = flying_between_third_and_fourth(0.0)
    since = last_number(vehicle)
    assert vehicle.set_mode(4, 4) == 0
    vehicle.run(0.2)
    assert vehicle.topics.mission_result.seq_current == 7
    assert said(vehicle, since)[:2] == [CAMERA_MODE, GIMBAL]
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == 4.0
    vehicle.run(15.0)
    assert vehicle.topics.mission_result.seq_current == 8
    assert DISTANCE not in said(vehicle, since)


@pytest.mark.parametrize(("chosen", "begins"), [(8, 8), (7, 6)])
def test_an_item_that_the_ground_chooses_is_where_it_begins_but_for_the_one_it_was_at(chosen: int, begins: int) -> None:
    """MissionBase::checkMissionDataChanged: the same item again is no news, so it still goes back for pictures."""
    vehicle = flying_between_third_and_fourth(25.0)
    assert vehicle.navigator.set_current_mission_item(vehicle.now_us, chosen)
    assert vehicle.set_mode(4, 4) == 0
    vehicle.run(0.2)
    assert vehicle.topics.mission_result.seq_current == begins


@pytest.mark.parametrize(
    ("command", "param1", "takes"),
    [(START, 0, True), (STOP, 0, False), (TRIGGER, 1, True), (TRIGGER, 0, False), (DISTANCE, 5, True),
     (DISTANCE, 0, False)],
)  # fmt: skip
def test_what_takes_pictures(command: int, param1: float, takes: bool) -> None:
    assert takes_pictures(item(command, 0, 0, 0, param1)) is takes
    assert not takes_pictures(None)


def test_a_speed_is_the_last_before_the_item_that_it_was_left_at() -> None:
    """Though it goes back to a place before that; a transition forgets it (MissionBase::cacheItem)."""
    resume = MissionResume()
    slow, fast = item(SPEED, 0, 0, 0, 1.0, 2.0), item(SPEED, 0, 0, 0, 1.0, 6.0)
    items = (slow, item(DISTANCE, 0, 0, 0, 5.0), item(WAYPOINT), fast, item(WAYPOINT, 50), item(3000))
    resume.leave(4)
    assert resume.begin(items, 4) == 2
    assert resume.take_speed() == fast
    assert resume.take_speed() is None
    assert resume.begin(items, 5) is None
    assert resume.begin((), 0) is None
    assert resume.take_speed() == fast, "not yet said"
    resume.begin(items, 6)
    assert resume.take_speed() is None


def test_the_last_of_a_kind_counts_and_is_said_once() -> None:
    resume = MissionResume()
    first, last = item(GIMBAL, 0, 0, 0, -10.0), item(GIMBAL, 0, 0, 0, -80.0)
    assert resume.begin((first, last, item(WAYPOINT)), 2) is None
    assert resume.due(2, climbing=True) == []
    assert resume.due(2, climbing=False) == [last]
    assert resume.due(3, climbing=False) == []
