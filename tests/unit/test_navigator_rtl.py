"""Where RTL_TYPE sends a return: along the mission, to its landing pattern, to a rally point; after PX4's RTL."""

import math
import struct

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.navigator.mission_legs import Landing, landing_of
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

from .navigation_fake import HOME_ALT, FakeVehicle, item
from .navigator_returns import (
    DIRECT,
    FOLLOW,
    JUMP,
    LAND,
    LAND_START,
    LOITER_TIME,
    MISSION_LAND,
    PATTERN,
    REVERSE,
    SPEED,
    TAKEOFF,
    TRIGGER,
    WAYPOINT,
    WITH_LANDING,
    WITHOUT,
    flying,
    place,
    return_home,
    rtl_status,
    run_until_reached,
)


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
    while vehicle.topics.rtl_time_estimate.timestamp != vehicle.now_us:
        vehicle.step()
    vehicle.east = 55.0
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


@pytest.mark.parametrize(("return_alt_m", "amsl_m", "above_m"), [(5.0, 502, 13), (30.0, 520, 31), (22.0, 512, 22)])
def test_a_return_tells_whole_metres(return_alt_m: float, amsl_m: int, above_m: int) -> None:
    """RtlDirect::on_activation rounds up what it has as float32: 519.4 - 489.4 is more than 30, 511.4 - 489.4 is 22."""
    vehicle = FakeVehicle(RTL_RETURN_ALT=return_alt_m, RTL_CONE_ANG=0)
    vehicle.run(3.0)
    vehicle.take_off(12.4)
    home = vehicle.topics.home_position
    vehicle.topics.home_position = home._replace(alt=HOME_ALT)
    vehicle.take_texts()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(0.2)
    assert f"RTL: start return at {amsl_m} m ({above_m} m above destination)" in vehicle.take_texts()
    event_id, formats = layout("vrtl_return_at")
    (told,) = [event for event in vehicle.events.recent if event.id == event_id]
    assert struct.unpack(f"<{formats}", told.arguments) == (amsl_m, above_m)


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
