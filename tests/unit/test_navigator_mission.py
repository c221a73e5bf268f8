"""Missions from start to end, paused and changed: what is reached and current, and what is said; as PX4 flew them."""

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.storage.dataman import FENCE, MISSION, Plan
from sitl_emu.core import dialect as mavlink

from .navigation_fake import PLACE, FakeVehicle, item
from .navigator_missions import (
    ACTIVE,
    COMPLETE,
    LAND,
    LOITER_TIME,
    NO_MISSION,
    NOT_STARTED,
    PAUSED,
    ROVER,
    RTL,
    SPEED,
    TAKEOFF,
    WAYPOINT,
    mission_state,
    run_until,
    started,
    uploaded,
)

FLIGHT_TEXTS = ["Armed by external command", "Executing Mission", "Climb to 8.0 meters above home", "Takeoff detected"]


def test_takeoff_waypoints_landing() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8), item(WAYPOINT, 20, 20, 8), item(LAND, 40, 20))
    vehicle.run_until_disarmed()
    assert vehicle.reached == [-1, 0, 1, 2, 3]
    assert vehicle.current == [0, 1, 2, 3]
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_MISSION"]
    texts = vehicle.take_texts()
    assert texts[:4] == FLIGHT_TEXTS
    assert sorted(texts[4:]) == ["Disarmed by landing", "Landing detected", "Mission finished, landed"]
    assert (round(vehicle.north), round(vehicle.east)) == (40, 20)
    assert mission_state(vehicle) == COMPLETE


def test_states_of_a_mission() -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    assert mission_state(vehicle) == NO_MISSION
    vehicle.upload(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 60, 0, 8))
    vehicle.run(0.1)
    assert mission_state(vehicle) == NOT_STARTED
    assert vehicle.topics.mission_result.seq_total == 2
    vehicle.set_mode(4, 4)
    vehicle.arm()
    run_until(vehicle, 0)
    assert mission_state(vehicle) == ACTIVE
    vehicle.set_mode(4, 3)
    vehicle.run(0.1)
    assert mission_state(vehicle) == PAUSED
    vehicle.dataman.store(MISSION, Plan(), 0)
    vehicle.run(0.1)
    assert mission_state(vehicle) == NO_MISSION


def test_a_mission_that_ends_in_the_air_ends_in_hold() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8))
    run_until(vehicle, 1)
    vehicle.run(5.0)
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_MISSION", "AUTO_LOITER"]
    assert vehicle.take_texts() == [*FLIGHT_TEXTS, "Mission finished, loitering"]
    assert round(vehicle.north) == 20
    assert vehicle.topics.mission_result.seq_current == 1


def test_where_the_ground_starts_a_mission_it_does_not_go_back_for_pictures() -> None:
    """Mission::set_current_mission_index forgets where the mission was left."""
    pictures = item(mavlink.MAV_CMD_DO_TRIGGER_CONTROL, 0, 0, 0, 1.0)
    places = [item(WAYPOINT, north, 0, 8) for north in (20, 40, 60)]
    vehicle = started(item(TAKEOFF, 0, 0, 8), pictures, *places)
    run_until(vehicle, 2)
    vehicle.set_mode(4, 3)
    vehicle.run(1.0)
    assert vehicle.result(mavlink.MAV_CMD_MISSION_START, 4, 0) == 0
    vehicle.run(1.0)
    assert vehicle.topics.mission_result.seq_current == 4


def test_a_mission_that_was_left_is_paused_until_a_landing_forgets_what_it_had_reached() -> None:
    """MissionBase::on_inactivation; what it sets is published by the next mode that does (Land::on_activation)."""
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8), item(WAYPOINT, 60, 0, 8))
    run_until(vehicle, 1)
    vehicle.set_mode(4, 3)
    vehicle.run(0.2)
    assert (mission_state(vehicle), vehicle.topics.mission_result.seq_reached) == (PAUSED, 1)
    vehicle.set_mode(4, 6)
    vehicle.run(0.2)
    assert (mission_state(vehicle), vehicle.topics.mission_result.seq_reached) == (ACTIVE, -1)
    vehicle.set_mode(4, 3)
    vehicle.run(0.2)
    assert mission_state(vehicle) == ACTIVE


def test_a_takeoff_completes_as_a_mission_does_but_a_return_does_not() -> None:
    """mission_result.finished: of TAKEOFF, LAND and missions, until one of them begins again."""
    vehicle = uploaded(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8))
    vehicle.take_off(5.0)
    assert (vehicle.mode, mission_state(vehicle)) == (NavState.AUTO_LOITER, COMPLETE)
    vehicle.set_mode(4, 4)
    vehicle.run(0.2)
    assert mission_state(vehicle) == ACTIVE
    vehicle.set_mode(4, 5)
    vehicle.run_until_disarmed()
    assert mission_state(vehicle) != COMPLETE


def test_rtl_item_ends_the_mission_then_returns() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 40, 0, 8), item(RTL))
    vehicle.run_until_disarmed()
    assert vehicle.reached == [-1, 0, 2]
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_MISSION", "AUTO_LOITER", "AUTO_RTL", "AUTO_LOITER"]
    assert vehicle.take_texts()[4:8] == [
        "Mission finished, loitering",
        "Returning to launch",
        "RTL: start return at 520 m (31 m above destination)",  # 519.4 - 489.4 of float32
        "RTL: land at destination",
    ]


def test_pause_and_go_on() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8), item(WAYPOINT, 60, 0, 8), item(LAND, 60, 0))
    run_until(vehicle, 1)
    vehicle.run(1.0)
    vehicle.set_mode(4, 3)
    vehicle.run(5.0)
    where = vehicle.north
    vehicle.run(5.0)
    assert vehicle.north == where
    vehicle.set_mode(4, 4)
    vehicle.run_until_disarmed()
    assert vehicle.reached == [-1, 0, 1, -1, 2, 3]


def test_a_mission_that_goes_on_keeps_its_speed() -> None:
    speed = item(SPEED, 0, 0, 0, 1, 2.0, -1)
    vehicle = started(item(TAKEOFF, 0, 0, 8), speed, item(WAYPOINT, 60, 0, 8), item(WAYPOINT, 90, 0, 8))
    run_until(vehicle, 1)
    vehicle.set_mode(4, 3)
    vehicle.run(1.0)
    vehicle.set_mode(4, 4)
    vehicle.run(1.0)
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == 2.0


def test_a_new_fence_leaves_the_vehicle_on_its_leg_and_a_new_mission_does_not() -> None:
    """MissionBase::on_active checks the mission again; MissionBase::onMissionUpdate resets the triplet."""
    items = item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8), item(WAYPOINT, 20, 90, 8)
    vehicle = started(*items)
    run_until(vehicle, 1)
    vehicle.run(2.0)
    before = vehicle.topics.position_setpoint_triplet.previous
    assert before.valid
    place = item(5003, 0, 0, 0, 500.0)._replace(frame=5)
    vehicle.dataman.store(FENCE, Plan((place,), opaque_id=2), vehicle.dataman.current_seq)
    vehicle.run(0.2)
    assert vehicle.topics.position_setpoint_triplet.previous == before
    numbered = tuple(each._replace(seq=seq) for seq, each in enumerate(items))
    vehicle.dataman.store(MISSION, Plan(numbered, opaque_id=3), vehicle.dataman.current_seq)
    vehicle.run(0.2)
    assert not vehicle.topics.position_setpoint_triplet.previous.valid


def test_an_item_chosen_before_another_mode_is_forgotten_by_the_ground_until_the_mission_goes_on() -> None:
    """MavlinkMissionManager::send takes the item of mission_result, which TAKEOFF publishes with the one of before."""
    vehicle = uploaded(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8), item(WAYPOINT, 40, 0, 8))
    vehicle.dataman.told_seq = 2
    assert vehicle.navigator.set_current_mission_item(vehicle.now_us, 2)
    vehicle.run(0.2)
    assert vehicle.dataman.told_seq == 2
    vehicle.take_off(5.0)
    assert (vehicle.dataman.told_seq, vehicle.dataman.current_seq) == (0, 2)
    vehicle.set_mode(4, 4)
    vehicle.run(0.2)
    assert vehicle.dataman.told_seq == 2


def test_set_current_goes_there_at_once() -> None:
    vehicle = started(
        item(TAKEOFF, 0, 0, 8),
        item(WAYPOINT, 20, 0, 8),
        item(WAYPOINT, 20, 90, 8),
        item(WAYPOINT, 40, 0, 8),
        item(LAND),
    )
    run_until(vehicle, 1)
    assert vehicle.navigator.set_current_mission_item(vehicle.now_us, 3)
    assert vehicle.topics.mission_result.seq_current == 3
    assert not vehicle.navigator.set_current_mission_item(vehicle.now_us, 5)
    vehicle.run(0.1)
    lat, _ = PLACE.reproject(40, 0)
    assert vehicle.topics.position_setpoint_triplet.current.lat == pytest.approx(lat, abs=1e-6)
    vehicle.run_until_disarmed()
    assert vehicle.reached == [-1, 0, 1, -1, 3, 4]


def test_a_new_mission_in_flight_begins_at_once() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 90, 0, 8))
    run_until(vehicle, 0)
    vehicle.take_texts()
    vehicle.upload(item(WAYPOINT, 0, 30, 8))
    vehicle.run(20.0)
    assert vehicle.take_texts() == ["Mission finished, loitering"]
    assert (round(vehicle.north), round(vehicle.east)) == (0, 30)


def test_a_mission_that_has_ended_in_the_air_is_none_until_the_ground_says_where() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 30, 0, 8))
    vehicle.run(20.0)
    assert vehicle.mode is NavState.AUTO_LOITER
    vehicle.take_texts()
    vehicle.set_mode(4, 4)
    vehicle.run(0.2)
    assert vehicle.take_texts() == ["No valid mission available, loitering"]
    assert vehicle.mode is NavState.AUTO_LOITER
    vehicle.navigator.set_current_mission_item(vehicle.now_us, 0)
    assert mission_state(vehicle) == COMPLETE
    vehicle.set_mode(4, 4)
    vehicle.run(0.2)
    assert vehicle.take_texts() == ["Executing Mission"]
    assert mission_state(vehicle) == ACTIVE


def test_a_mission_that_is_cleared_in_flight_ends_in_hold() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 90, 0, 8))
    run_until(vehicle, 0)
    vehicle.take_texts()
    vehicle.dataman.store(MISSION, Plan(), 0)
    vehicle.run(0.2)
    assert vehicle.take_texts() == ["No valid mission available, loitering"]
    assert vehicle.mode is NavState.AUTO_LOITER


def test_paused_before_anything_was_reached_it_still_says_active() -> None:
    vehicle = uploaded(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 90, 0, 8))
    vehicle.navigator.set_current_mission_item(vehicle.now_us, 1)
    assert mission_state(vehicle) == NOT_STARTED
    vehicle.set_mode(4, 4)
    vehicle.arm()
    vehicle.run(5.0)
    vehicle.set_mode(4, 3)
    vehicle.run(0.2)
    assert mission_state(vehicle) == ACTIVE


def test_a_mission_climbs_before_it_begins() -> None:
    vehicle = started(item(WAYPOINT, 40, 0, 12))
    vehicle.run(4.0)
    assert vehicle.take_texts()[1:3] == ["Executing Mission", "Climb to 12.0 meters above home"]
    assert SetpointType.TAKEOFF in vehicle.setpoints
    vehicle.run(15.0)
    assert vehicle.reached == [-1, 0]
    hovering = FakeVehicle()
    hovering.run(3.0)
    hovering.take_off(5.0)
    hovering.upload(item(WAYPOINT, 40, 0, 12))
    hovering.run(0.1)
    hovering.take_texts()
    hovering.set_mode(4, 4)
    hovering.run(0.5)
    assert hovering.take_texts() == ["Executing Mission", "Climb to 12.0 meters above home"]
    assert hovering.setpoints[-1] is SetpointType.LOITER
    assert hovering.north == pytest.approx(0.0, abs=0.1)


def test_once_more_after_landing() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 6), item(WAYPOINT, 12, 0, 6), item(LAND, 12, 0))
    vehicle.run_until_disarmed()
    assert vehicle.mode is NavState.AUTO_MISSION
    vehicle.reached.clear()
    vehicle.current.clear()
    vehicle.run(2.0)
    assert vehicle.set_mode(4, 4) == 0
    assert vehicle.arm() == 0
    vehicle.run_until_disarmed()
    assert vehicle.current == [2, 0, 2]
    assert vehicle.reached == [2, -1, 1, 2]


def test_a_place_near_the_takeoff_is_reached_at_once_behind_it() -> None:
    """A waypoint 5 m away, within NAV_ACC_RAD: PX4's links hear of the last alone."""
    vehicle = started(item(TAKEOFF, 0, 0, 5), item(WAYPOINT, 5.5, 0, 5), item(LAND, 5.5, 0))
    vehicle.run_until_disarmed()
    assert vehicle.current == [0, 2]
    assert vehicle.reached == [-1, 1, 2]


def test_uploading_does_not_start_anything() -> None:
    vehicle = uploaded(item(TAKEOFF, 0, 0, 8), item(LAND))
    vehicle.set_mode(4, 4)
    vehicle.run(1.0)
    assert vehicle.take_texts() == []
    assert not vehicle.topics.position_setpoint_triplet.current.valid


def test_a_takeoff_item_in_the_air_is_a_waypoint() -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.take_off(10.0)
    vehicle.upload(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8), item(LAND, 20, 0))
    vehicle.run(0.1)
    vehicle.take_texts()
    assert vehicle.result(mavlink.MAV_CMD_MISSION_START, 0, 0) == 0
    vehicle.run_until_disarmed()
    assert vehicle.take_texts()[0] == "Executing Mission"
    assert vehicle.reached[-3:] == [0, 1, 2]
    assert SetpointType.TAKEOFF not in vehicle.setpoints[3:]


def test_a_rover_drives_a_square_without_holding_at_waypoints() -> None:
    rover = started(
        item(WAYPOINT, 12, 0, 0, 60.0),
        item(WAYPOINT, 12, 12),
        item(WAYPOINT, 0, 12),
        rover=True,
        **ROVER,
    )
    run_until(rover, 2)
    rover.run(1.0)
    assert rover.reached == [-1, 0, 1, 2]
    assert rover.mode is NavState.AUTO_LOITER
    assert rover.armed
    assert rover.take_texts() == [
        "Armed by external command",
        "Executing Mission",
        "Takeoff detected",
        "Mission finished, loitering",
    ]


def test_a_rover_never_reaches_a_landing() -> None:
    rover = started(
        item(TAKEOFF, 6, 0, 5),
        item(WAYPOINT, 12, 0),
        item(LOITER_TIME, 12, 8, 0, 3.0),
        item(LAND, 4, 8),
        rover=True,
    )
    rover.run(30.0)
    assert rover.reached == [-1, 0, 1, 2]
    assert rover.mode is NavState.AUTO_MISSION
    assert rover.armed


def test_what_has_become_of_the_mission_is_not_told_anew_by_another_mode() -> None:
    """PX4 publishes mission_result where the mission changes it (set_mission_result_updated), and not by arming."""
    vehicle = uploaded(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 60, 0, 8))
    before = vehicle.topics.mission_result
    vehicle.set_mode(4, 5)
    vehicle.run(0.5)
    vehicle.set_mode(4, 3)
    assert vehicle.arm() == 0
    vehicle.run(0.5)
    assert vehicle.topics.mission_result.timestamp == before.timestamp
    vehicle.set_mode(4, 4)
    run_until(vehicle, 0)
    assert vehicle.topics.mission_result.timestamp > before.timestamp
    assert mission_state(vehicle) == ACTIVE
