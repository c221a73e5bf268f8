"""What the items of a mission make the vehicle do, and the setpoints that come of them; after PX4's flights."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink

from .navigation_fake import HOME_ALT, PLACE, FakeVehicle, item
from .navigator_missions import (
    DELAY,
    JUMP,
    LAND,
    LOITER_TIME,
    LOITER_TO_ALT,
    ROI_LOCATION,
    ROVER,
    SPEED,
    TAKEOFF,
    WAYPOINT,
    run_until,
    started,
)


def test_items_carried_out_on_the_way_hide_the_place_before_them() -> None:
    vehicle = started(
        item(TAKEOFF, 0, 0, 8),
        item(WAYPOINT, 30, 0, 8),
        item(SPEED, 0, 0, 0, 1, 3.0, -1),
        item(WAYPOINT, 60, 0, 8),
        item(LAND, 60, 0),
    )
    run_until(vehicle, 2)
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == 3.0
    vehicle.run_until_disarmed()
    assert vehicle.reached == [-1, 0, 2, 3, 4]
    assert vehicle.current == [0, 1, 3, 4]


def test_jumps() -> None:
    vehicle = started(
        item(TAKEOFF, 0, 0, 8),
        item(WAYPOINT, 25, 0, 8),
        item(WAYPOINT, 25, 20, 8),
        item(JUMP, 0, 0, 0, 1, 2),
        item(WAYPOINT, 0, 20, 8),
        item(LAND, 0, 20),
    )
    vehicle.run_until_disarmed()
    assert vehicle.reached == [-1, 0, 1, 2, 1, 2, 1, 2, 4, 5]
    assert vehicle.current == [0, 1, 2, 1, 2, 1, 2, 4, 5]


def test_a_jump_to_itself_does_not_hang() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(JUMP, 0, 0, 0, 1, -1))
    vehicle.run(15.0)
    assert vehicle.mode is NavState.AUTO_LOITER


def test_a_jump_to_nowhere_ends_the_mission_where_it_stands() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8), item(JUMP, 0, 0, 0, 7, 1), item(LAND))
    vehicle.run(15.0)
    assert vehicle.reached == [-1, 0, 1]
    assert vehicle.take_texts()[-1] == "Mission finished, loitering"


def test_a_jump_that_is_used_up_stays_so_within_another() -> None:
    vehicle = started(
        item(TAKEOFF, 0, 0, 8),
        item(WAYPOINT, 30, 0, 8),
        item(WAYPOINT, 30, 30, 8),
        item(JUMP, 0, 0, 0, 1, 1),
        item(JUMP, 0, 0, 0, 1, 1),
        item(LAND),
    )
    vehicle.run_until_disarmed()
    assert vehicle.reached == [-1, 0, 1, 2, 1, 2, 1, 2, 5]


def test_a_used_up_jump_at_the_end_leads_to_what_cannot_be_read() -> None:
    """MissionBase::getNonJumpItem: by each look ahead from its last round on, and when the mission ends."""
    nothing = "Waypoint could not be read."
    places = item(WAYPOINT, 20, 0, 8), item(WAYPOINT, 60, 0, 8)
    vehicle = started(item(TAKEOFF, 0, 0, 8), *places, item(JUMP, 0, 0, 0, 1, 1))
    vehicle.run(40.0)
    assert vehicle.reached == [-1, 0, 1, 2, 1, 2]
    assert vehicle.take_texts()[-4:] == [nothing] * 3 + ["Mission finished, loitering"]
    assert vehicle.navigator.set_current_mission_item(vehicle.now_us, 3)
    vehicle.set_mode(4, 4)
    vehicle.run(1.0)
    assert vehicle.take_texts()[-2:] == [nothing, "Mission item could not be set."]


def test_hold_times() -> None:
    vehicle = started(
        item(TAKEOFF, 0, 0, 8),
        item(WAYPOINT, 30, 0, 8, 4.0),
        item(LOITER_TIME, 60, 0, 8, 3.0),
        item(DELAY, 0, 0, 0, 5.0, -1, -1),
        item(WAYPOINT, 60, 30, 8),
    )
    vehicle.step()
    times: dict[int, float] = {}
    while vehicle.mode is not NavState.AUTO_LOITER or not vehicle.armed:
        vehicle.step()
        times.setdefault(vehicle.topics.mission_result.seq_reached, vehicle.now_us * 1e-6)
    assert times[1] - times[0] == pytest.approx(20 / 5 + 4.0, abs=0.5)
    assert times[2] - times[1] == pytest.approx(20 / 5 + 3.0, abs=0.5)
    assert times[3] - times[2] == pytest.approx(5.0, abs=0.1)


@pytest.mark.parametrize(("yaw_deg", "told_deg"), [(90.0, 90.0), (-90.0, 270.0), (math.nan, math.nan)])
def test_a_places_yaw_is_told_between_0_and_360_degrees(yaw_deg: float, told_deg: float) -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 40, 0, 8, 0.0, 0.0, 0.0, yaw_deg))
    run_until(vehicle, 0)
    vehicle.run(0.1)
    yaw_rad = vehicle.topics.position_setpoint_triplet.current.yaw
    assert math.degrees(yaw_rad) == pytest.approx(told_deg, nan_ok=True)


def test_a_delay_without_a_number_is_none() -> None:
    """MissionBlock::get_time_inside takes the larger of it and 0, which for NaN is 0."""
    nan = math.nan
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(DELAY, 0, 0, 0, nan, nan, nan, nan), item(WAYPOINT, 20, 0, 8))
    run_until(vehicle, 2)


def test_acceptance_radius_and_yaw_of_an_item() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 40, 0, 8, 0.0, 3.0), item(WAYPOINT, 80, 0, 8))
    run_until(vehicle, 1)
    assert 37.0 <= vehicle.north < 37.5  # the fake's step is 0.2 m, and every other is looked at
    turning = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 40, 0, 8, 0.0, 0.0, 0.0, 90.0))
    turning.run(30.0)
    assert turning.reached == [-1, 0]  # the fake never turns
    turning.heading_is_good = False
    turning.run(1.0)
    assert turning.reached == [-1, 0, 1]


@pytest.mark.parametrize(("insists", "reached", "failed"), [(0.0, [-1, 1, 2], False), (1.0, [-1, 1], True)])
def test_with_a_time_limit_only_a_forced_heading_is_waited_for(
    insists: float, reached: list[int], failed: bool
) -> None:
    """MIS_YAW_TMT; the fake never turns to what it shall look at."""
    roi, place = item(ROI_LOCATION, 40, 400, 0), item(LOITER_TIME, 40, 0, 8, 0.0, insists, 0.0, 1.0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), roi, place, item(WAYPOINT, 80, 0, 8), MIS_YAW_TMT=2.0)
    vehicle.run(22.0)
    assert vehicle.reached[: len(reached)] == reached
    assert ("unable to reach heading within timeout" in vehicle.take_texts()) is failed
    assert (3 in vehicle.reached) is not failed


def test_the_limit_of_a_forced_heading_counts_in_whole_seconds() -> None:
    """MIS_YAW_TMT of 0.9 s is none at all; the fake never turns to what it shall look at."""
    place = item(LOITER_TIME, 40, 0, 8, 0.0, 1.0, 0.0, 1.0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(ROI_LOCATION, 40, 400, 0), place, MIS_YAW_TMT=0.9)
    while vehicle.north < 30.0:
        vehicle.step()
    vehicle.run(0.3)
    assert vehicle.topics.mission_result.failure


@pytest.mark.parametrize("command", [mavlink.MAV_CMD_NAV_LOITER_TIME, mavlink.MAV_CMD_NAV_LOITER_TO_ALT])
def test_who_circles_has_no_heading(command: int) -> None:
    """Param4 says how the circle is left (MavlinkMissionManager::parse_mavlink_mission_item)."""
    place = item(command, 40, 0, 8, 0.0, 0.0, 0.0, 90.0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), place, item(WAYPOINT, 80, 0, 8), NAV_LOITER_RAD=5.0)
    run_until(vehicle, 0)
    vehicle.run(0.1)
    assert vehicle.topics.position_setpoint_triplet.current.type == SetpointType.LOITER
    assert math.isnan(vehicle.topics.position_setpoint_triplet.current.yaw)
    run_until(vehicle, 2)


@pytest.mark.parametrize(("radius_m", "north_m"), [(20.0, 59.6), (-20.0, 20.4)])
def test_a_circle_that_is_left_on_its_tangent_begins_the_next_leg_there(radius_m: float, north_m: float) -> None:
    """MissionBlock::is_mission_item_reached_or_completed (loiter_exit_xtrack): cos of the angle is 20 m / 100 m."""
    circle = item(LOITER_TO_ALT, 40, 0, 8, 0.0, radius_m, 0.0, 1.0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), circle, item(WAYPOINT, 40, 100, 8))
    run_until(vehicle, 0)
    vehicle.run(0.1)
    current = vehicle.topics.position_setpoint_triplet.current
    assert (current.loiter_radius, current.loiter_direction_counter_clockwise) == (20.0, radius_m < 0.0)
    run_until(vehicle, 1)
    vehicle.run(0.1)
    previous = vehicle.topics.position_setpoint_triplet.previous
    assert previous.type == SetpointType.POSITION
    assert PLACE.project(previous.lat, previous.lon) == pytest.approx((north_m, 4.0), abs=0.1)


@pytest.mark.parametrize(("radius_m", "circle_m"), [(0.0, 40.0), (math.nan, 40.0), (20.0, 30.0), (-20.0, 30.0)])
def test_loiter_to_alt_changes_its_height_on_its_circle(radius_m: float, circle_m: float) -> None:
    """As high as before on the way; within acceptance radius and circle (else NAV_LOITER_RAD) it is climbed."""
    climb = item(LOITER_TO_ALT, 120, 0, 20, 0.0, radius_m)
    vehicle = started(item(TAKEOFF, 0, 0, 8), climb, item(WAYPOINT, 160, 0, 20), NAV_LOITER_RAD=30.0)
    run_until(vehicle, 0)
    while vehicle.topics.position_setpoint_triplet.current.alt < HOME_ALT + 18.0:
        assert vehicle.up < 8.6
        vehicle.step()
    assert 120.0 - vehicle.north == pytest.approx(circle_m, abs=0.5)
    assert vehicle.topics.position_setpoint_triplet.current.loiter_radius == pytest.approx(circle_m - 10.0)
    run_until(vehicle, 1)
    assert vehicle.up == pytest.approx(19.5, abs=0.5)


def test_a_gate_is_passed_on_the_way_to_the_place_behind_it() -> None:
    """It is flown to nowhere; beside it counts too (MissionBlock::is_mission_item_reached_or_completed)."""
    gate = item(mavlink.MAV_CMD_CONDITION_GATE, 60, 30, 0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), gate, item(WAYPOINT, 120, 30, 8), item(WAYPOINT, 160, 30, 8))
    run_until(vehicle, 0)
    vehicle.run(0.1)
    triplet = vehicle.topics.position_setpoint_triplet
    places = [PLACE.project(setpoint.lat, setpoint.lon) for setpoint in (triplet.current, triplet.next)]
    assert [(round(north), round(east)) for north, east in places] == [(120, 30), (160, 30)]
    run_until(vehicle, 1)
    assert vehicle.north == pytest.approx(60.0, abs=0.5)
    assert vehicle.east < 20.0
    run_until(vehicle, 3)
    assert vehicle.reached == [-1, 0, 1, 2, 3]


@pytest.mark.parametrize(("kind", "flown"), [(0.0, -1.0), (1.0, 3.0)])
def test_a_ground_speed_alone_changes_the_leg_that_is_flown(kind: float, flown: float) -> None:
    """FlightModeManager::handleCommand; the navigator's own value counts from the next setpoint on."""
    items = item(TAKEOFF, 0, 0, 8), item(SPEED, 0, 0, 0, kind, 3.0, -1), item(DELAY, 0, 0, 0, 2.0, -1, -1)
    vehicle = started(*items, item(WAYPOINT, 60, 0, 8))
    run_until(vehicle, 1)
    vehicle.run(0.5)
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == flown
    run_until(vehicle, 2)
    vehicle.run(0.2)
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == 3.0


def test_a_mission_that_begins_with_a_speed_is_driven_at_it() -> None:
    """MissionBase::on_activation forgets the speed of before; the first item's is obeyed in the next cycle."""
    rover = started(item(SPEED, 0, 0, 0, 1, 1.2, -1), item(WAYPOINT, 20, 0), item(WAYPOINT, 20, 20), rover=True)
    run_until(rover, 0)
    rover.run(0.2)
    assert rover.topics.position_setpoint_triplet.current.cruising_speed == pytest.approx(1.2)


def test_what_the_navigator_obeys_itself_is_answered_in_the_log() -> None:
    """Navigator::publish_vehicle_command_ack; who asked was the vehicle itself, so on no link."""
    roi = item(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 30, 30, 0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(SPEED, 0, 0, 0, 1, 3.0, -1), roi, item(WAYPOINT, 60, 0, 8))
    run_until(vehicle, 2)
    answers = [each for each in vehicle.topics.commands_told if each.result is not None and not each.from_outside]
    assert [(each.command.command, each.result[0]) for each in answers if each.result] == [(SPEED, 0), (roi.command, 0)]
    assert {(each.command.source_system, each.command.source_component) for each in answers} == {(1, 1)}


def test_a_mission_may_disarm_and_tune() -> None:
    """MissionBlock::issue_command: the modules obey as they would the ground."""
    tune = item(mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE, 0, 0, 0, 1.0)
    disarm = item(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 0, 0.0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), tune, item(WAYPOINT, 12, 0, 8), item(LAND, 12, 0), disarm)
    vehicle.parameters.set("COM_DISARM_LAND", -1.0)
    vehicle.run_until_disarmed()
    given = [record.command for record in vehicle.topics.navigator_commands]
    assert [command.command for command in given if command.command in (tune.command, disarm.command)] == [212, 400]
    assert {(command.param5, command.param6) for command in given} == {(0.0, 0.0)}
    assert vehicle.reached[-1] >= 3


@pytest.mark.parametrize(
    ("command", "param1"), [(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -90.0), (mavlink.MAV_CMD_DO_WINCH, 1.0)]
)
def test_gimbal_and_winch_are_given_their_time(command: int, param1: float) -> None:
    """MIS_COMMAND_TOUT, though there is no winch."""
    places = item(TAKEOFF, 0, 0, 8), item(command, 0, 0, 0, param1), item(WAYPOINT, 20, 0, 8)
    vehicle = started(*places, MIS_COMMAND_TOUT=5.0)
    run_until(vehicle, 0)
    vehicle.run(4.5)
    assert vehicle.reached[-1] == 0
    vehicle.run(1.0)
    assert vehicle.reached[-1] == 1


@pytest.mark.parametrize(("insists", "radius_m", "waits"), [(1.0, 10.0, True), (0.0, 10.0, False), (1.0, 0.0, False)])
def test_a_rover_leaves_a_circle_on_course(insists: float, radius_m: float, waits: bool) -> None:
    """MissionBlock::is_mission_item_reached_or_completed: within 5 degrees, if the item has a heading required.

    Not where the next place is within the circle, here of NAV_LOITER_RAD.
    """
    circle = item(LOITER_TIME, 20, 0, 0, 0.0, insists, radius_m)
    rover = started(circle, item(WAYPOINT, 20, 30), rover=True)
    rover.run(6.0)
    assert (rover.reached[-1] == -1) is waits
    for velocity in ((0.0, 0.0), (0.2, 1.0)):
        rover.velocity = velocity
        rover.run(0.2)
        assert (rover.reached[-1] == -1) is waits
    rover.velocity = 0.05, 1.0
    rover.run(0.2)
    assert rover.reached[-1] == 0


def test_a_gimbal_that_is_given_no_time_delays_nothing() -> None:
    """MissionBase::setMissionIndex wakes the navigator at once, and no time is over by then."""
    gimbal = item(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, 0, 0, 0, -90.0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), gimbal, item(WAYPOINT, 20, 0, 8))
    run_until(vehicle, 1)
    assert vehicle.reached == [-1, 1]
    assert vehicle.topics.mission_result.seq_current == 2


def test_relative_altitudes_follow_home() -> None:
    """MissionBase::updateMissionAltAfterHomeChanged."""
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 40, 0, 8), item(WAYPOINT, 200, 0, 10), item(LAND, 200, 0))
    run_until(vehicle, 1)
    vehicle.run(1.0)
    before, home = vehicle.topics.position_setpoint_triplet, vehicle.topics.home_position
    vehicle.topics.home_position = home._replace(alt=home.alt + 3.0, update_count=home.update_count + 1)
    vehicle.run(0.2)
    after = vehicle.topics.position_setpoint_triplet
    for setpoint, known in zip(after[1:], before[1:], strict=True):
        assert setpoint.alt == pytest.approx(known.alt + 3.0)
    run_until(vehicle, 2)
    assert vehicle.up == pytest.approx(13.3, abs=0.5)


def test_a_mission_has_no_leg_before_its_first_setpoint() -> None:
    """Mission::setActiveMissionItems: the setpoint before, of which there is none."""
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 40, 0, 8), item(WAYPOINT, 40, 40, 8))
    vehicle.run(0.2)
    assert not vehicle.topics.position_setpoint_triplet.previous.valid
    run_until(vehicle, 1)
    vehicle.run(0.1)
    lat, _ = PLACE.reproject(40, 0)
    assert vehicle.topics.position_setpoint_triplet.previous.lat == pytest.approx(lat, abs=1e-6)


def test_a_landing_keeps_the_leg_that_led_to_it() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 20, 0, 8), item(LAND, 80, 0))
    while vehicle.topics.position_setpoint_triplet.current.type != SetpointType.LAND:
        vehicle.step()
    lat, _ = PLACE.reproject(20, 0)
    assert vehicle.topics.position_setpoint_triplet.previous.lat == pytest.approx(lat, abs=1e-6)


@pytest.mark.parametrize(("vz", "stops"), [(1.0, True), (0.0, False)])
def test_a_descent_stops_above_terrain(vz: float, stops: bool) -> None:
    """NAV_MIN_GND_DIST (updateAltToAvoidTerrainCollisionAndRepublishTriplet)."""
    vehicle = BelowIsTerrain(vz)
    vehicle.run(3.0)
    vehicle.upload(item(TAKEOFF, 0, 0, 20), item(WAYPOINT, 60, 0, 5), item(WAYPOINT, 120, 0, 5))
    vehicle.run(0.1)
    vehicle.set_mode(4, 4)
    vehicle.arm()
    vehicle.run(40.0)
    assert ("Terrain collision risk, descent is stopped" in vehicle.take_texts()) is stops
    assert vehicle.up == pytest.approx(12.0 if stops else 5.0, abs=0.5)


class BelowIsTerrain(FakeVehicle):
    """Four metres above the ground at 12 m above home; it sinks at `vz`."""

    def __init__(self, vz: float) -> None:
        super().__init__(NAV_MIN_GND_DIST=4.0)
        self.vz = vz

    def _sense(self) -> None:
        super()._sense()
        local = self.topics.vehicle_local_position
        self.topics.vehicle_local_position = local._replace(
            vz=self.vz, dist_bottom=self.up - 8.0, dist_bottom_valid=self.up > 8.0
        )


def test_positions_are_kept_to_a_ten_millionth_degree() -> None:
    assert math.isclose(item(WAYPOINT, 10, 0, 5).lat_deg, PLACE.reproject(10, 0)[0], abs_tol=1e-7)


def test_a_rovers_next_place_lies_behind_jumps_delays_and_holds() -> None:
    """As of a real one that circled its LOITER_TIME: it brakes for no hold (Mission::setActiveMissionItems)."""
    rover = started(
        item(WAYPOINT, 8, 0),
        item(WAYPOINT, 8, 8),
        item(DELAY, 0, 0, 0, 1.0, -1, -1),
        item(JUMP, 0, 0, 0, 0, 1),
        item(LOITER_TIME, 0, 8, 0, 3.0),
        item(WAYPOINT, 0, 0),
        rover=True,
        **ROVER,
    )
    following: dict[int, set[tuple[int, int]]] = {}
    for _ in range(25 * 60):
        rover.step()
        triplet = rover.topics.position_setpoint_triplet
        if rover.mode is NavState.AUTO_MISSION and triplet.next.valid:
            north, east = PLACE.project(triplet.next.lat, triplet.next.lon)
            following.setdefault(rover.topics.mission_result.seq_current, set()).add((round(north), round(east)))
    assert following == {0: {(8, 8)}, 1: {(8, 0), (0, 8)}, 4: {(0, 0)}}


@pytest.mark.parametrize(
    ("second", "follows"),
    [
        (item(WAYPOINT, 60, 0, 6), True),
        (item(WAYPOINT, 60, 0, 6, 2.0), False),
        (item(LOITER_TIME, 60, 0, 6, 2.0), False),
    ],
)
def test_a_multicopter_brakes_for_a_hold_alone(second: MissionItem, follows: bool) -> None:
    """A takeoff's pitch is none."""
    vehicle = started(item(TAKEOFF, 40, 0, 6, 15.0), second, item(WAYPOINT, 60, 60, 6))
    while vehicle.topics.mission_result.seq_current < 1:
        vehicle.step()
        if vehicle.topics.position_setpoint_triplet.current.type == SetpointType.POSITION:
            assert vehicle.topics.position_setpoint_triplet.next.valid or vehicle.topics.mission_result.seq_current
    vehicle.run(0.2)
    assert vehicle.topics.position_setpoint_triplet.next.valid is follows


def given(vehicle: FakeVehicle, number: int) -> VehicleCommand:
    """The command of an item, as the navigator gave it."""
    for record in reversed(vehicle.topics.navigator_commands):
        if record.command.command == number:
            return record.command
    raise AssertionError(f"{number} was not given")


def test_an_item_that_sets_home_has_whole_degrees() -> None:
    """Its x and y as they came: MAV_FRAME_MISSION scales nothing."""
    home = MissionItem(0, 2, mavlink.MAV_CMD_DO_SET_HOME, 1, 0.0, 0.0, 0.0, 0.0, 47, 8, 480.0)
    vehicle = started(item(TAKEOFF, 0, 0, 6), home, item(WAYPOINT, 30, 0, 6), COM_HOME_EN=1)
    run_until(vehicle, 1)
    vehicle.run(0.1)
    command = given(vehicle, mavlink.MAV_CMD_DO_SET_HOME)
    assert (command.param5, command.param6, command.param7) == (47.0, 8.0, 480.0)
    assert vehicle.topics.home_position[2:5] == pytest.approx((47.0, 8.0, 480.0))


def test_an_item_that_looks_beside_the_next_place_gives_its_offsets_in_degrees() -> None:
    beside = MissionItem(0, 2, mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET, 1, 0.0, 0.0, 0.0, 0.0, -30, 0, 90.0)
    vehicle = started(item(TAKEOFF, 0, 0, 6), beside, item(WAYPOINT, 80, 0, 6))
    run_until(vehicle, 1)
    roi = vehicle.topics.vehicle_roi
    assert (roi.mode, roi.pitch_offset, roi.yaw_offset) == pytest.approx((1, math.radians(-30.0), math.pi / 2.0))


def test_on_the_way_to_a_landing_the_ground_is_the_next_place() -> None:
    vehicle = started(item(TAKEOFF, 0, 0, 6), item(WAYPOINT, 20, 0, 6), item(LAND, 50, 0))
    for _ in range(3000):
        vehicle.step()
        if vehicle.topics.mission_result.seq_current == 2:
            break
    vehicle.run(0.1)
    triplet = vehicle.topics.position_setpoint_triplet
    assert triplet.current.type == SetpointType.POSITION
    assert triplet.next.valid
    assert triplet.next.type == SetpointType.LAND
    assert triplet.next.alt < triplet.current.alt


def test_the_log_is_told_of_each_item_as_px4_tells_it() -> None:
    """Relative altitudes stay as they are in the plan, but for the climb before it (Mission::handleTakeoff)."""
    vehicle = started(item(TAKEOFF, up_m=10.0), item(WAYPOINT, 20.0, 0.0, 10.0))
    vehicle.run(0.1)
    told = vehicle.topics.navigator_mission_item
    assert (told.nav_cmd, told.origin, told.frame, told.altitude_is_relative) == (TAKEOFF, 0, 6, False)
    assert told.altitude == pytest.approx(HOME_ALT + 10.0)
    run_until(vehicle, reached=0)
    vehicle.run(0.2)
    told = vehicle.topics.navigator_mission_item
    assert (told.sequence_current, told.nav_cmd, told.origin) == (1, WAYPOINT, 0)
    assert told.altitude_is_relative
    assert vehicle.topics.navigator_status.nav_state == NavState.AUTO_MISSION


def test_the_log_is_told_of_items_without_a_place_and_of_the_end_too() -> None:
    """MissionBase::publish_navigator_mission_item; parameters 2 to 4 lie where a place has other numbers."""
    delay = item(DELAY, 0, 0, 0, 2.0, -1.0, -2.0, -3.0)._replace(frame=2, z=7.0)
    vehicle = started(item(TAKEOFF, up_m=10.0), delay, item(WAYPOINT, 20.0, 0.0, 10.0))
    run_until(vehicle, reached=0)
    vehicle.run(0.2)
    told = vehicle.topics.navigator_mission_item
    assert (told.sequence_current, told.nav_cmd, told.time_inside, told.frame) == (1, DELAY, 2.0, 2)
    assert (told.latitude, told.longitude, told.altitude) == (0.0, 0.0, 7.0)
    assert (told.acceptance_radius, told.loiter_radius, told.yaw) == (-1.0, -2.0, -3.0)
    run_until(vehicle, reached=2)
    vehicle.run(0.2)
    told = vehicle.topics.navigator_mission_item
    assert (told.nav_cmd, told.origin, told.autocontinue) == (mavlink.MAV_CMD_NAV_LOITER_UNLIM, 1, False)
    assert told.altitude == pytest.approx(HOME_ALT + 10.0)
    landing = started(item(TAKEOFF, up_m=10.0), item(LAND, 0.0, 0.0))
    landing.run_until_disarmed()
    told = landing.topics.navigator_mission_item
    assert (told.sequence_current, told.nav_cmd, told.origin) == (1, 0, 0)
