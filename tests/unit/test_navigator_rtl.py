"""Where RTL_TYPE sends a return: along the mission, to its landing pattern, to a rally point; after PX4's RTL."""

import math
import struct

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.navigator.mission_legs import Landing, landing_of
from sitl_emu.autopilot.storage.dataman import RALLY, MissionItem, Plan
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

from .navigation_fake import HOME_ALT, PLACE, FakeVehicle, item

TAKEOFF, WAYPOINT, LAND = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LAND
LOITER_TIME, LOITER_TO_ALT = mavlink.MAV_CMD_NAV_LOITER_TIME, mavlink.MAV_CMD_NAV_LOITER_TO_ALT
LAND_START, JUMP, SPEED = mavlink.MAV_CMD_DO_LAND_START, mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_CHANGE_SPEED
TRIGGER = mavlink.MAV_CMD_DO_TRIGGER_CONTROL
DIRECT, MISSION_LAND, FOLLOW, REVERSE = 1, 2, 3, 4
"""rtl_status.rtl_type."""
WITH_LANDING = (
    item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 60, 0, 8), item(WAYPOINT, 60, 60, 8), item(WAYPOINT, 0, 60, 8),
    item(LAND, -40, 60),
)  # fmt: skip
WITHOUT = WITH_LANDING[:-1]
PATTERN = (
    item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 60, 0, 8), item(WAYPOINT, 120, 0, 8), item(LAND_START),
    item(WAYPOINT, 60, 60, 12), item(WAYPOINT, 30, 60, 10), item(LAND, 0, 60),
)  # fmt: skip


def flying(*items: MissionItem, **parameters: float) -> FakeVehicle:
    """In MISSION, just armed."""
    vehicle = FakeVehicle(**{"RTL_RETURN_ALT": 15.0, "NAV_ACC_RAD": 2.0} | parameters)
    vehicle.run(3.0)
    vehicle.upload(*items)
    vehicle.run(0.1)
    assert vehicle.set_mode(4, 4) == 0
    assert vehicle.arm() == 0
    return vehicle


def run_until_reached(vehicle: FakeVehicle, seq: int) -> None:
    for _ in range(3000):
        vehicle.step()
        if vehicle.topics.mission_result.seq_reached == seq:
            return
    raise AssertionError(f"{seq} is not reached, only {vehicle.reached}")


def return_home(vehicle: FakeVehicle) -> list[str]:
    """Return, land; what was said."""
    vehicle.take_texts()
    vehicle.reached.clear()
    vehicle.current.clear()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run_until_disarmed()
    return vehicle.take_texts()


def place(vehicle: FakeVehicle) -> tuple[int, int]:
    return round(vehicle.north), round(vehicle.east)


def rally(vehicle: FakeVehicle, north_m: float, east_m: float, frame: int = 3) -> None:
    lat, lon = PLACE.reproject(north_m, east_m)
    point = MissionItem(
        0, frame, mavlink.MAV_CMD_NAV_RALLY_POINT, 1, 0, 0, 0, math.nan, round(lat * 1e7), round(lon * 1e7), 0.0
    )
    vehicle.dataman.store(RALLY, Plan((point,)), 0)
    vehicle.run(2.1)


def rtl_status(vehicle: FakeVehicle) -> tuple[int, int]:
    status = vehicle.topics.rtl_status
    return status.rtl_type, status.safe_point_index


def test_on_along_the_mission_to_its_landing() -> None:
    """As a real PX4 flew it: reached 2>3>4, current 3>4, these texts."""
    vehicle = flying(*WITH_LANDING, RTL_TYPE=2)
    run_until_reached(vehicle, 1)
    vehicle.run(2.0)
    texts = return_home(vehicle)
    assert vehicle.reached == [-1, 2, 3, 4]
    assert vehicle.current == [2, 3, 4]
    assert place(vehicle) == (-40, 60)
    assert texts[0] == "Executing Mission"
    assert sorted(texts[1:]) == ["Disarmed by landing", "Landing detected", "Mission finished, landed"]
    assert rtl_status(vehicle)[0] == FOLLOW


def test_out_of_hold_the_nearest_place_comes_first() -> None:
    vehicle = flying(*WITH_LANDING, RTL_TYPE=2)
    run_until_reached(vehicle, 1)
    vehicle.run(2.0)
    assert vehicle.set_mode(4, 3) == 0
    vehicle.run(2.0)
    return_home(vehicle)
    assert vehicle.reached == [-1, 1, 2, 3, 4]
    assert place(vehicle) == (-40, 60)


@pytest.mark.parametrize("rtl_type", [2, 4])
def test_back_along_a_mission_that_does_not_land(rtl_type: int) -> None:
    vehicle = flying(*WITHOUT, RTL_TYPE=rtl_type)
    run_until_reached(vehicle, 2)
    vehicle.run(2.0)
    most_east = 0.0
    vehicle.take_texts()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.reached.clear()
    while vehicle.armed:
        vehicle.step()
        most_east = max(most_east, vehicle.east)
    assert vehicle.reached == [-1, 2, 1, 0]
    assert place(vehicle) == (0, 0)
    assert most_east == pytest.approx(60.0, abs=1.0)
    assert rtl_status(vehicle)[0] == REVERSE


@pytest.mark.parametrize(("reached", "end"), [(1, (0, 0)), (3, (-40, 60))])
def test_type_4_takes_the_way_with_fewer_items(reached: int, end: tuple[int, int]) -> None:
    vehicle = flying(*WITH_LANDING, RTL_TYPE=4)
    run_until_reached(vehicle, reached)
    vehicle.run(0.5)
    return_home(vehicle)
    assert place(vehicle) == end


@pytest.mark.parametrize(("waits_s", "first"), [(0.2, 2), (2.2, 3)])
def test_a_return_that_has_just_turned_round_begins_at_the_nearest_place(waits_s: float, first: int) -> None:
    """RTL::initRtlMissionType makes a return anew, which has not seen the item that is flown; it is asked every 2 s."""
    vehicle = flying(*WITH_LANDING, RTL_TYPE=4, NAV_ACC_RAD=0.5)
    run_until_reached(vehicle, 1)
    while vehicle.east < 55.0 or vehicle.topics.rtl_time_estimate.timestamp != vehicle.now_us:
        vehicle.step()
    run_until_reached(vehicle, 2)
    vehicle.run(waits_s)
    vehicle.current.clear()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(0.2)
    assert vehicle.topics.rtl_status.rtl_type == FOLLOW
    assert min(vehicle.current) == first


def test_back_with_a_negative_delay_it_holds_above_home() -> None:
    vehicle = flying(*WITHOUT, RTL_TYPE=2, RTL_LAND_DELAY=-1.0, RTL_DESCEND_ALT=6.0)
    run_until_reached(vehicle, 1)
    vehicle.run(0.5)
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(60.0)
    assert (place(vehicle), round(vehicle.up)) == ((0, 0), 6)
    assert vehicle.armed
    assert vehicle.topics.position_setpoint_triplet.current.type == SetpointType.LOITER


def test_what_is_no_place_is_left_out() -> None:
    """Neither the delay of a place nor a jump: each place once, without a stop."""
    items = (*WITH_LANDING[:2], item(LOITER_TIME, 60, 60, 8, 30.0), item(JUMP, 0, 0, 0, 1, 5), *WITH_LANDING[3:])
    vehicle = flying(*items, RTL_TYPE=2)
    run_until_reached(vehicle, 1)
    vehicle.run(0.2)
    begin_us = vehicle.now_us
    return_home(vehicle)
    assert vehicle.reached == [-1, 2, 4, 5]
    assert (vehicle.now_us - begin_us) * 1e-6 < 60.0


def test_the_missions_speed_is_kept() -> None:
    items = (*WITHOUT[:2], item(SPEED, 0, 0, 0, 1.0, 3.0), *WITHOUT[2:])
    vehicle = flying(*items, RTL_TYPE=2)
    run_until_reached(vehicle, 3)
    vehicle.run(2.0)
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(1.0)
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == 3.0


@pytest.mark.parametrize(
    ("rtl_type", "kind", "end"), [(0, DIRECT, (0, 0)), (1, MISSION_LAND, (0, 60)), (3, DIRECT, (0, 0))]
)
def test_straight_to_a_landing_pattern(rtl_type: int, kind: int, end: tuple[int, int]) -> None:
    """From 90 m north home is nearer than the landing: 3 goes home, 1 never does where there is a landing."""
    vehicle = flying(*PATTERN, RTL_TYPE=rtl_type)
    run_until_reached(vehicle, 1)
    vehicle.run(6.0)
    texts = return_home(vehicle)
    assert rtl_status(vehicle)[0] == kind
    assert place(vehicle) == end
    if kind == MISSION_LAND:
        assert vehicle.reached == [-1, 3, 4, 5, 6]
        assert texts[0] == "Executing Mission"


def test_type_3_takes_a_landing_pattern_that_is_nearer() -> None:
    vehicle = flying(*PATTERN, RTL_TYPE=3)
    run_until_reached(vehicle, 1)
    vehicle.east = 60.0
    return_home(vehicle)
    assert place(vehicle) == (0, 60)


def test_it_climbs_first_where_it_is_lower() -> None:
    vehicle = flying(*PATTERN, RTL_TYPE=1, RTL_RETURN_ALT=20.0)
    run_until_reached(vehicle, 1)
    texts = return_home(vehicle)
    assert texts[:2] == ["Executing Mission", f"RTL Mission land: climb to {math.ceil(HOME_ALT + 20.0)} m"]


def test_it_climbs_with_the_heading_of_the_item_that_begins_the_landing() -> None:
    """RtlDirectMissionLand::setActiveMissionItems leaves the item's yaw, DO_LAND_START's fourth parameter."""
    north = item(LAND_START, 0, 0, 0, 0.0, 0.0, 0.0, 0.0)
    vehicle = flying(*PATTERN[:3], north, *PATTERN[4:], RTL_TYPE=1, RTL_RETURN_ALT=20.0)
    run_until_reached(vehicle, 1)
    vehicle.turned = 1.0
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(15.0)
    assert vehicle.topics.position_setpoint_triplet.current.yaw == 0.0
    assert vehicle.up == pytest.approx(20.0, abs=0.1)
    vehicle.turned = 0.0
    vehicle.run(0.2)
    assert math.isnan(vehicle.topics.position_setpoint_triplet.current.yaw)
    assert vehicle.topics.mission_result.seq_current == 4


def test_a_mission_on_its_landing_pattern_goes_on_with_it() -> None:
    """MISSION flies on under RTL (Navigator::run), and is not begun anew by going back to MISSION."""
    vehicle = flying(*PATTERN)
    run_until_reached(vehicle, 4)
    vehicle.run(1.0)
    vehicle.take_texts()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(1.0)
    assert vehicle.mode is NavState.AUTO_RTL
    assert not any("RTL" in text for text in vehicle.take_texts())
    assert vehicle.set_mode(4, 4) == 0
    vehicle.run(1.0)
    assert vehicle.take_texts() == []
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run_until_disarmed()
    assert place(vehicle) == (0, 60)


def test_a_mission_that_lands_under_rtl_and_is_sent_back_returns() -> None:
    """Navigator::run asks anew in every run whether the mission is landing."""
    vehicle = flying(*PATTERN)
    run_until_reached(vehicle, 4)
    vehicle.run(1.0)
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(1.0)
    vehicle.take_texts()
    assert vehicle.navigator.set_current_mission_item(vehicle.now_us, 1)
    vehicle.run(1.0)
    assert any(text.startswith("RTL: start return") for text in vehicle.take_texts())
    vehicle.run_until_disarmed()
    assert place(vehicle) == (0, 0)


def test_before_its_landing_pattern_a_mission_is_left() -> None:
    vehicle = flying(*PATTERN)
    run_until_reached(vehicle, 1)
    vehicle.run(2.0)
    return_home(vehicle)
    assert place(vehicle) == (0, 0)


def test_a_ground_station_may_choose_the_item_on_the_way() -> None:
    vehicle = flying(*WITH_LANDING, RTL_TYPE=2)
    run_until_reached(vehicle, 1)
    vehicle.take_texts()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(0.5)
    vehicle.reached.clear()
    assert vehicle.navigator.set_current_mission_item(vehicle.now_us, 4)
    vehicle.run_until_disarmed()
    assert vehicle.reached == [-1, 4]
    assert place(vehicle) == (-40, 60)


@pytest.mark.parametrize(("rtl_type", "pauses"), [(2, 1), (0, 0)])
def test_a_return_along_the_mission_that_is_left_pauses_the_camera(rtl_type: int, pauses: int) -> None:
    """MissionBase::on_inactivation, as of a mission."""
    vehicle = flying(*WITH_LANDING, RTL_TYPE=rtl_type)
    run_until_reached(vehicle, 1)
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(1.0)
    number = vehicle.topics.navigator_commands[-1].number
    assert vehicle.set_mode(4, 3) == 0
    vehicle.run(0.2)
    given = [record.command for record in vehicle.topics.navigator_commands if record.number > number]
    assert sum(command.command == TRIGGER and command.param1 == -1.0 for command in given) == pauses


def test_the_event_of_a_return_tells_whole_metres_as_its_text_does() -> None:
    """RtlDirect::on_activation rounds both up."""
    vehicle = FakeVehicle(RTL_RETURN_ALT=5.0)
    vehicle.run(3.0)
    vehicle.take_off(12.4)
    vehicle.take_texts()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(0.2)
    assert f"RTL: start return at {math.ceil(HOME_ALT + 12.4)} m (13 m above destination)" in vehicle.take_texts()
    event_id, formats = layout("vrtl_return_at")
    (told,) = [event for event in vehicle.events.recent if event.id == event_id]
    assert struct.unpack(f"<{formats}", told.arguments) == (math.ceil(HOME_ALT + 12.4), 13)


def test_without_a_mission_it_goes_straight_home() -> None:
    vehicle = FakeVehicle(RTL_TYPE=2)
    vehicle.run(3.0)
    vehicle.take_off(10.0)
    vehicle.reposition(40.0, 0.0, 10.0)
    vehicle.run(12.0)
    texts = return_home(vehicle)
    assert "RTL: land at destination" in texts
    assert place(vehicle) == (0, 0)


def test_on_the_ground_it_refuses_to_take_off() -> None:
    vehicle = FakeVehicle(RTL_TYPE=2)
    vehicle.run(3.0)
    vehicle.upload(*WITHOUT)
    vehicle.run(2.5)
    assert vehicle.arm() == 0
    vehicle.take_texts()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(1.0)
    assert "No valid mission available, refusing takeoff" in vehicle.take_texts()
    assert vehicle.topics.position_setpoint_triplet.current.type == SetpointType.IDLE


def test_a_rally_point_is_arrived_at_with_any_heading() -> None:
    vehicle = flying(*WITHOUT)
    run_until_reached(vehicle, 1)
    rally(vehicle, 60.0, 40.0)
    assert rtl_status(vehicle) == (DIRECT, 0)
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(12.0)
    assert math.isnan(vehicle.topics.position_setpoint_triplet.current.yaw)
    vehicle.run_until_disarmed()
    assert place(vehicle) == (60, 40)


def test_a_rally_point_where_nobody_has_said_where_is_none() -> None:
    """RTL::extractValidSafePointPosition."""
    vehicle = flying(*WITHOUT)
    nowhere = MissionItem(0, 3, mavlink.MAV_CMD_NAV_RALLY_POINT, 1, 0, 0, 0, math.nan, 0, 0, 0.0)
    beyond = nowhere._replace(x=910000000, y=10)
    vehicle.parameters.set("RTL_TYPE", 5)
    vehicle.dataman.store(RALLY, Plan((nowhere, beyond)), 0)
    vehicle.run(2.1)
    assert rtl_status(vehicle) == (DIRECT, 255)


def test_a_return_that_waits_moves_to_its_place_again_before_it_lands() -> None:
    """RtlDirect::_updateRtlState, by what it tells the log (4 and 5 are a VTOL's); its height does not matter there."""
    vehicle = flying(*WITHOUT, RTL_TYPE=0, RTL_LAND_DELAY=3.0, RTL_DESCEND_ALT=6.0)
    run_until_reached(vehicle, 1)
    assert vehicle.set_mode(4, 5) == 0
    phases: list[int] = []
    heights: dict[int, float] = {}
    looks_down: list[int] = []
    while vehicle.armed:
        vehicle.step()
        told, triplet = vehicle.topics.navigator_mission_item, vehicle.topics.position_setpoint_triplet
        if vehicle.mode is NavState.AUTO_RTL and phases[-1:] != [told.sequence_current]:
            phases.append(told.sequence_current)
            heights[told.sequence_current] = triplet.current.alt_acceptance_radius
            looks_down.append(vehicle.topics.distance_sensor_mode_change_request.request_on_off)
            if told.sequence_current == 2:
                assert (triplet.next.valid, triplet.next.type, triplet.next.alt) == (True, SetpointType.LAND, 0.0)
        if phases[-1:] == [3]:
            vehicle.up = 12.0
    assert phases == [0, 1, 2, 3, 6, 7, 8]
    assert looks_down == [0, 0, 1, 1, 1, 1, 0]
    assert math.isnan(heights[1])
    assert heights[3] == heights[6] > 1e38


def test_a_return_that_waits_turns_before_it_lands() -> None:
    vehicle = flying(*WITHOUT, RTL_TYPE=0, RTL_LAND_DELAY=2.0, RTL_DESCEND_ALT=6.0)
    run_until_reached(vehicle, 1)
    assert vehicle.set_mode(4, 5) == 0
    while vehicle.topics.navigator_mission_item.sequence_current != 3:
        vehicle.step()
    assert math.isnan(vehicle.topics.position_setpoint_triplet.current.yaw)
    vehicle.turned = 2.0
    vehicle.run(10.0)
    assert vehicle.topics.navigator_mission_item.sequence_current == 6
    vehicle.turned = 0.0
    vehicle.run(0.2)
    assert vehicle.topics.navigator_mission_item.sequence_current == 7


def test_a_rally_point_over_terrain_is_none() -> None:
    vehicle = flying(*WITHOUT)
    rally(vehicle, 60.0, 40.0, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT)
    assert rtl_status(vehicle) == (DIRECT, 255)


def test_type_5_without_a_rally_point_lands_where_it_is_and_warns() -> None:
    vehicle = FakeVehicle(RTL_TYPE=5)
    vehicle.run(5.0)
    assert set(vehicle.take_texts()) == {"No rally point configured"}
    vehicle.take_off(10.0)
    vehicle.reposition(40.0, 0.0, 10.0)
    vehicle.run(12.0)
    return_home(vehicle)
    assert place(vehicle) == (40, 0)


def test_how_long_the_landing_pattern_takes() -> None:
    """60 m to its first place at 5 m/s, 30 m on, 30 m and 10 m down at 1.5 m/s; the other ways PX4 does not know."""
    vehicle = flying(*PATTERN, RTL_TYPE=1, MPC_XY_CRUISE=5.0, RTL_RETURN_ALT=5.0)
    run_until_reached(vehicle, 1)
    vehicle.topics.rtl_time_estimate = vehicle.topics.rtl_time_estimate._replace(timestamp=0)
    while vehicle.topics.rtl_time_estimate.timestamp == 0:
        vehicle.step()
    away_m = math.hypot(vehicle.north - 60.0, 60.0)
    estimate = vehicle.topics.rtl_time_estimate
    assert estimate.valid
    assert estimate.time_estimate == pytest.approx(away_m / 5.0 + 30.0 / 5.0 + 10.0 / 1.5, abs=0.5)
    vehicle.parameters.set("RTL_TYPE", 2)
    vehicle.run(2.1)
    assert not vehicle.topics.rtl_time_estimate.valid


def test_how_long_a_landing_pattern_with_a_hold_takes() -> None:
    """RtlDirectMissionLand::calc_rtl_time_estimate forgets all that comes before a LOITER_UNLIM, and counts on."""
    hold = item(mavlink.MAV_CMD_NAV_LOITER_UNLIM, 30, 60, 10)
    vehicle = flying(*PATTERN[:5], hold, *PATTERN[6:], RTL_TYPE=1, MPC_XY_CRUISE=5.0, RTL_RETURN_ALT=5.0)
    run_until_reached(vehicle, 1)
    vehicle.run(2.1)
    assert vehicle.topics.rtl_time_estimate.valid
    assert vehicle.topics.rtl_time_estimate.time_estimate == pytest.approx(10.0 / 1.5, abs=0.1)


@pytest.mark.parametrize(("limit_m_s", "seconds"), [(2.5, 110.0 / 2.5), (-1.0, 0.0)])
def test_a_rover_is_timed_by_its_speed_limit(limit_m_s: float, seconds: float) -> None:
    """RtlTimeEstimator; 30 m and 40 m away to the beginning of the landing, 60 m on to its end."""
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN, RTL_TYPE=1, RO_SPEED_LIM=limit_m_s)
    rover.run(3.0)
    rover.upload(item(WAYPOINT, 10, 0), item(LAND_START), item(WAYPOINT, 30, 40), item(LAND, 30, 100))
    rover.run(2.1)
    assert rtl_status(rover)[0] == MISSION_LAND
    estimate = rover.topics.rtl_time_estimate
    assert estimate.valid
    assert estimate.time_estimate == pytest.approx(seconds, abs=0.1)


def test_a_rover_follows_its_mission_too() -> None:
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN, RTL_TYPE=2)
    rover.run(3.0)
    rover.upload(item(WAYPOINT, 20, 0), item(WAYPOINT, 20, 20))
    rover.run(2.1)
    assert rover.set_mode(4, 4) == 0
    assert rover.arm() == 0
    run_until_reached(rover, 0)
    rover.run(1.0)
    rover.set_mode(4, 5)
    rover.run(0.5)
    assert rtl_status(rover)[0] == REVERSE
    rover.run_until_disarmed()
    assert place(rover) == (0, 0)


@pytest.mark.parametrize(
    ("commands", "landing"),
    [
        ((TAKEOFF, WAYPOINT), None),
        ((TAKEOFF, WAYPOINT, LAND), Landing(2, 2)),
        ((TAKEOFF, LAND_START, WAYPOINT, LAND), Landing(1, 3)),
        ((TAKEOFF, LAND_START, LAND_START, LAND, LAND), Landing(1, 3)),
        ((TAKEOFF, LAND, LAND_START), Landing(1, 1)),
        ((TAKEOFF, LAND_START), None),
    ],
)
def test_where_a_missions_landing_begins(commands: tuple[int, ...], landing: Landing | None) -> None:
    assert landing_of([item(command) for command in commands]) == landing


def test_a_return_along_the_mission_follows_home() -> None:
    """MissionBase::updateMissionAltAfterHomeChanged."""
    vehicle = flying(*WITH_LANDING, RTL_TYPE=2)
    run_until_reached(vehicle, 1)
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(1.0)
    before, home = vehicle.topics.position_setpoint_triplet.current.alt, vehicle.topics.home_position
    vehicle.topics.home_position = home._replace(alt=home.alt + 3.0, update_count=home.update_count + 1)
    vehicle.run(0.2)
    assert vehicle.topics.position_setpoint_triplet.current.alt == pytest.approx(before + 3.0)
    run_until_reached(vehicle, 2)
    assert vehicle.up == pytest.approx(11.3, abs=0.5)


def test_a_return_that_has_landed_completes_no_mission() -> None:
    vehicle = flying(*WITHOUT, RTL_TYPE=0)
    run_until_reached(vehicle, 1)
    return_home(vehicle)
    assert vehicle.topics.mission_result.mission_state != mavlink.MISSION_STATE_COMPLETE
