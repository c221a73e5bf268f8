"""Returns along the mission are missions of their own: they say again, go back, look and land as MISSION does."""

import math

import pytest

from sitl_emu.autopilot.constants import SetpointType
from sitl_emu.core import dialect as mavlink

from .navigation_fake import PLACE, FakeVehicle, item
from .navigator_returns import LAND, TAKEOFF, WAYPOINT, WITHOUT, flying, run_until_reached

CAMERA_MODE, GIMBAL = mavlink.MAV_CMD_SET_CAMERA_MODE, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
DISTANCE = mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST
SURVEY = (
    item(TAKEOFF, 0, 0, 8), item(CAMERA_MODE), item(GIMBAL, 0, 0, 0, -45.0), item(DISTANCE, 0, 0, 0, 25.0),
    item(WAYPOINT, 60, 0, 8), item(WAYPOINT, 120, 0, 8), item(WAYPOINT, 120, 90, 8), item(LAND, 60, 90),
)  # fmt: skip


def surveying(**parameters: float) -> FakeVehicle:
    """On the way to item 6, some metres behind 5; its heading does not matter."""
    vehicle = flying(*SURVEY, **{"RTL_TYPE": 2} | parameters)
    run_until_reached(vehicle, 5)
    vehicle.run(6.0)
    vehicle.heading_is_good = False
    return vehicle


def said(vehicle: FakeVehicle) -> list[int]:
    """Camera's and gimbal's commands since the last call, but for what centres the gimbal."""
    records, vehicle.topics.navigator_commands = vehicle.topics.navigator_commands, ()
    wanted = (CAMERA_MODE, GIMBAL, DISTANCE)
    given = [record.command for record in records if record.command.command in wanted]
    return [command.command for command in given if not math.isnan(command.param1)]


def change_mode(vehicle: FakeVehicle, sub_mode: int) -> None:
    assert vehicle.set_mode(4, sub_mode) == 0
    vehicle.run(0.2)


def test_it_says_again_what_was_said_to_camera_and_gimbal() -> None:
    """MissionBase::on_active: modes and gimbal at once, that pictures are taken behind the next place."""
    vehicle = surveying()
    said(vehicle)
    change_mode(vehicle, 5)
    assert said(vehicle) == [CAMERA_MODE, GIMBAL]
    run_until_reached(vehicle, 6)
    vehicle.run(0.2)
    assert said(vehicle) == [DISTANCE]


@pytest.mark.parametrize(("moves_on", "begins"), [(False, 5), (True, 7)])
def test_a_return_that_was_left_goes_back_a_place_for_its_pictures(moves_on: bool, begins: int) -> None:
    """MissionBase::on_activation; whoever moves the mission on meanwhile ends that (onMissionUpdate)."""
    vehicle = surveying()
    vehicle.run(6.0)
    change_mode(vehicle, 5)
    assert vehicle.topics.mission_result.seq_current == 6
    change_mode(vehicle, 3)
    if moves_on:
        vehicle.north, vehicle.east = 70.0, 90.0
        assert vehicle.navigator.set_current_mission_item(vehicle.now_us, 4)
    change_mode(vehicle, 5)
    assert vehicle.dataman.current_seq == begins


def test_a_mission_that_a_return_has_moved_on_does_not_go_back() -> None:
    """Mission sees that the current item is another than it was left at (checkMissionDataChanged)."""
    vehicle = surveying()
    change_mode(vehicle, 5)
    run_until_reached(vehicle, 6)
    vehicle.run(0.2)
    change_mode(vehicle, 4)
    assert vehicle.topics.mission_result.seq_current == 7


def test_it_looks_at_a_region_of_interest() -> None:
    """MissionBase::heading_sp_update."""
    vehicle = surveying()
    change_mode(vehicle, 5)
    assert math.isnan(vehicle.topics.position_setpoint_triplet.current.yaw)
    vehicle.command(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 0, 0, 0, 0, *PLACE.reproject(9000.0, vehicle.east), 0.0)
    vehicle.run(0.2)
    assert vehicle.topics.position_setpoint_triplet.current.yaw == pytest.approx(0.0, abs=0.01)


def test_a_return_that_is_left_has_reached_nothing() -> None:
    """MissionBase::on_inactivation."""
    vehicle = surveying()
    change_mode(vehicle, 5)
    run_until_reached(vehicle, 6)
    change_mode(vehicle, 3)
    assert vehicle.navigator._state.seq_reached == -1


def test_after_a_precision_landing_a_return_back_along_the_mission_takes_off_again() -> None:
    """RtlMissionFastReverse::handleLanding does nothing to the take-off's item on the ground."""
    vehicle = flying(*WITHOUT, RTL_TYPE=2, RTL_PLD_MD=1, COM_DISARM_LAND=60.0)
    run_until_reached(vehicle, 1)
    change_mode(vehicle, 5)
    vehicle.take_texts()
    run_until_reached(vehicle, 0)
    assert vehicle.landed
    vehicle.run(0.2)
    assert vehicle.topics.position_setpoint_triplet.current.type == SetpointType.TAKEOFF
    vehicle.run(20.0)
    assert vehicle.take_texts() == ["Landing detected", "Takeoff detected", "Mission finished, loitering"]
    assert vehicle.up == pytest.approx(8.0, abs=2.0)
