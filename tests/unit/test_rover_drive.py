"""The rover's control on a bicycle: arrivals, corners, modes, limits."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.control.rover_ackermann import NEEDED_TO_DRIVE, NEEDED_TO_STEER
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.topics import (
    ActuatorArmed,
    ManualControlSetpoint,
    OffboardSetpoint,
    VehicleAttitudeSetpoint,
    VehicleRatesSetpoint,
)
from tests.unit.rover_body import RoverBody

AROUND = [(20.0, 0.0), (0.0, 20.0), (-12.0, 4.0), (-8.0, 0.0), (0.0, -5.0), (3.0, 3.0), (-1.0, -3.0), (40.0, 40.0)]


@pytest.mark.parametrize("place", AROUND)
def test_the_field_rover_stops_within_a_metre_wherever_its_target_lies(place: tuple[float, float]) -> None:
    rover = RoverBody("rover")
    rover.go(place)
    rover.drive(12.0 + math.hypot(*place))
    assert math.dist((rover.north, rover.east), place) < 0.6
    assert abs(rover.speed) < 0.05


def test_a_rover_has_no_setpoints_of_aircraft_to_stream() -> None:
    """PX4's rover sends neither ATTITUDE_TARGET nor POSITION_TARGET_LOCAL_NED: nobody publishes what they tell."""
    rover = RoverBody("rover")
    rover.go((5.0, 0.0))
    rover.drive(5.0)
    assert rover.topics.vehicle_attitude_setpoint.timestamp == 0
    assert rover.topics.vehicle_local_position_setpoint.timestamp == 0


def test_setpoints_of_aircraft_are_published_as_they_come_in_offboard_and_move_nothing() -> None:
    """mavlink_receiver.cpp publishes an attitude or rates in OFFBOARD, armed or not, whatever the vehicle."""
    rover = RoverBody("sihsim_rover_ackermann", NavState.OFFBOARD)
    rover.topics.actuator_armed = ActuatorArmed(armed=False)
    early = VehicleAttitudeSetpoint(rover.now_us)
    rover.topics.vehicle_status = rover.topics.vehicle_status._replace(nav_state_timestamp=rover.now_us + 1)
    rover.topics.offboard_setpoint = OffboardSetpoint(early.timestamp, attitude=early)
    rover.drive(0.1)
    assert rover.topics.vehicle_attitude_setpoint.timestamp == 0
    attitude = VehicleAttitudeSetpoint(rover.now_us, thrust_body=(0.4, 0.0, 0.0))
    rover.topics.offboard_setpoint = OffboardSetpoint(rover.now_us, attitude=attitude)
    rover.drive(0.1)
    rates = VehicleRatesSetpoint(rover.now_us, thrust_body=(0.4, 0.0, 0.0))
    rover.topics.offboard_setpoint = OffboardSetpoint(rover.now_us, rates=rates)
    rover.drive(0.1)
    assert rover.topics.vehicle_attitude_setpoint is attitude
    assert rover.topics.vehicle_rates_setpoint is rates
    assert rover.topics.actuator_outputs.timestamp == 0


def test_controllers_publish_what_they_ask_of_each_other() -> None:
    """A line to the east from 1 m beside it: the rover looks ahead to it, and every controller says what it does."""
    rover = RoverBody("sihsim_rover_ackermann")
    rover.go((-1.0, -10.0), (-1.0, 40.0))
    rover.east = 0.0
    rover.drive(3.0)
    topics = rover.topics
    place, pursuit = topics.rover_position_setpoint, topics.pure_pursuit_status
    assert place.position_ned == pytest.approx((-1.0, 40.0), abs=0.01)
    assert place.start_ned == pytest.approx((-1.0, -10.0), abs=0.01) and place.cruising_speed == 3.0
    assert pursuit.crosstrack_error == pytest.approx(-1.0 - rover.north, abs=0.1)
    assert pursuit.distance_to_waypoint == pytest.approx(40.0 - rover.east, abs=0.2)
    assert topics.rover_attitude_setpoint.yaw_setpoint == pursuit.target_bearing
    assert topics.rover_attitude_status.measured_yaw == pytest.approx(rover.heading, abs=0.05)
    assert topics.rover_speed_status.measured_speed_body_x == pytest.approx(rover.speed, abs=0.1)
    assert 0.0 < topics.rover_speed_status.adjusted_speed_body_x_setpoint <= topics.rover_speed_setpoint.speed_body_x
    assert math.isfinite(topics.rover_rate_setpoint.yaw_rate_setpoint)
    assert math.isfinite(topics.rover_rate_status.adjusted_yaw_rate_setpoint)
    outputs, throttle = topics.actuator_outputs.controls, topics.rover_throttle_setpoint
    assert throttle.throttle_body_x in outputs and math.isnan(throttle.throttle_body_y)
    assert topics.rover_steering_setpoint.normalized_steering_setpoint == pytest.approx(min(outputs), abs=0.05)


def test_by_sticks_only_throttle_and_steering_are_published() -> None:
    rover = RoverBody("sihsim_rover_ackermann", NavState.MANUAL)
    rover.topics.manual_control_setpoint = ManualControlSetpoint(rover.now_us, True, throttle=0.5, roll=0.2)
    rover.drive(1.0)
    topics = rover.topics
    throttle = topics.rover_throttle_setpoint
    assert (throttle.throttle_body_x, throttle.throttle_body_y) == (0.5, 0.0)
    assert topics.rover_steering_setpoint.normalized_steering_setpoint == 0.2
    silent = (topics.rover_speed_setpoint, topics.rover_speed_status, topics.rover_rate_status)
    assert not any(each.timestamp for each in silent)


@pytest.mark.parametrize("mode", [NavState.STAB, NavState.POSCTL])
def test_where_a_stick_steers_the_record_says_that_no_heading_and_no_place_is_sought(mode: NavState) -> None:
    """AckermannManualMode publishes NaN "Set uncontrolled setpoint invalid" in every cycle."""
    rover = sticks(mode, 0.4)
    rover.drive(1.0)
    topics = rover.topics
    assert topics.rover_attitude_setpoint.yaw_setpoint == pytest.approx(0.0, abs=0.01)
    assert topics.rover_position_setpoint.timestamp == 0 or topics.rover_position_setpoint.position_ned[0] > 0.0
    topics.manual_control_setpoint = topics.manual_control_setpoint._replace(roll=0.2)
    rover.drive(1.0)
    stamps = {topics.rover_attitude_setpoint.timestamp, topics.rover_rate_setpoint.timestamp}
    assert math.isnan(topics.rover_attitude_setpoint.yaw_setpoint)
    if mode is NavState.POSCTL:
        nowhere = topics.rover_position_setpoint
        stamps.add(nowhere.timestamp)
        assert all(map(math.isnan, (*nowhere.position_ned, *nowhere.start_ned, nowhere.cruising_speed)))
    assert len(stamps) == 1 and stamps.pop() >= rover.now_us - 10_000


@pytest.mark.parametrize("mode", [NavState.OFFBOARD, NavState.POSCTL])
def test_offboard_and_sticks_say_no_speed_to_arrive_with(mode: NavState) -> None:
    rover = sticks(mode, 0.4)
    rover.offboard(position=(20.0, 0.0, 0.0))
    rover.drive(1.0)
    told = rover.topics.rover_position_setpoint
    assert told.position_ned[0] > 0.0 and math.isnan(told.arrival_speed)
    assert told.timestamp >= rover.now_us - 10_000, "in every cycle"


def test_a_target_straight_behind_is_turned_to_slowly() -> None:
    rover = RoverBody("sihsim_rover_ackermann")
    rover.go((-12.0, 0.0))
    speeds = [row[3] for row in rover.drive(10.0)]
    assert max(speeds[:250]) < 2.0 < max(speeds)
    assert math.dist((rover.north, rover.east), (-12.0, 0.0)) < 0.5


def test_it_drives_at_the_speed_limit_or_at_the_triplets_speed() -> None:
    rover = RoverBody("sihsim_rover_ackermann")
    rover.go((40.0, 0.0))
    assert max(row[3] for row in rover.drive(6.0)) == pytest.approx(3.0, abs=0.1)
    rover.go((80.0, 0.0), speed=1.5)
    assert rover.drive(6.0)[-1][3] == pytest.approx(1.5, abs=0.1)


def test_uphill_it_drives_at_the_speed_along_the_slope() -> None:
    rover = RoverBody("rover")
    rover.slope = math.radians(30.0)
    rover.go((400.0, 0.0), speed=1.5)
    assert rover.drive(10.0)[-1][3] == pytest.approx(1.5, abs=0.02)


def test_a_speed_limit_of_zero_keeps_it_where_it_is() -> None:
    rover = RoverBody("sihsim_rover_ackermann", RO_SPEED_LIM=0.0)
    rover.go((10.0, 0.0))
    rover.drive(5.0)
    assert rover.north == pytest.approx(0.0, abs=0.01)


def missing(rover: RoverBody) -> list[str]:
    """The parameters of which events have told that they are not set."""
    names = {layout(event)[0]: name for event, name in (*NEEDED_TO_STEER, NEEDED_TO_DRIVE)}
    return [names[event.id] for event in rover.texts.events.recent]


def test_what_is_not_set_is_told_as_the_mode_begins_and_as_a_parameter_changes() -> None:
    """RoverAckermann::runSanityChecks: the speed is looked at only where the rover could steer."""
    rover = RoverBody("sihsim_rover_ackermann", NavState.MANUAL, RO_SPEED_LIM=0.0, RO_YAW_RATE_LIM=0.0)
    rover.drive(1.0)
    assert missing(rover) == []
    rover.topics.vehicle_status = rover.topics.vehicle_status._replace(nav_state=NavState.AUTO_LOITER)
    rover.drive(1.0)
    assert missing(rover) == ["RO_YAW_RATE_LIM"]
    rover.parameters.set("RO_YAW_RATE_LIM", 90.0)
    rover.drive(1.0)
    assert missing(rover) == ["RO_YAW_RATE_LIM", "RO_SPEED_LIM"]
    rover.parameters.set("RO_SPEED_LIM", 2.0)
    rover.drive(1.0)
    assert missing(rover) == ["RO_YAW_RATE_LIM", "RO_SPEED_LIM"]


def test_it_accelerates_within_ro_accel_lim() -> None:
    rover = RoverBody("sihsim_rover_ackermann", RO_ACCEL_LIM=0.8)
    rover.go((40.0, 0.0))
    speeds = [row[3] for row in rover.drive(5.0)]
    # every second step is 12 ms long and counts as 10; the drive lags behind by 0.15 s
    assert speeds[500] == pytest.approx(0.8 * 0.9 * (2.0 - 0.15), abs=0.1)


def test_it_turns_within_ro_yaw_rate_lim() -> None:
    rover = RoverBody("sihsim_rover_ackermann", RO_YAW_RATE_LIM=40.0)
    rover.go((0.0, 14.0))
    headings = [row[2] for row in rover.drive(4.0)]
    rates = [math.remainder(b - a, math.tau) / 0.004 for a, b in zip(headings, headings[50:], strict=False)]
    assert max(rates) / 50.0 == pytest.approx(math.radians(40.0), rel=0.08)


def test_a_corner_is_slowed_down_for() -> None:
    rover = RoverBody("sihsim_rover_ackermann")
    radius = 1.28
    rover.go((0.0, 0.0), (15.0, 0.0), (15.0, 15.0))
    rows = rover.drive(8.0)
    at_corner = next(row[3] for row in rows if row[0] > 15.0 - radius)
    assert at_corner == pytest.approx(1.6, abs=0.2)
    assert max(row[3] for row in rows) > 2.8


def test_a_mission_leg_is_driven_along_its_line() -> None:
    rover = RoverBody("rover")
    rover.go((0.0, 3.0), (40.0, 3.0))
    rows = rover.drive(20.0)
    assert all(abs(row[1] - 3.0) < 0.1 for row in rows if row[0] > 15.0)


def test_hold_at_a_place_passed_turns_back_to_it() -> None:
    rover = RoverBody("sihsim_rover_ackermann")
    rover.go((30.0, 0.0))
    rover.drive(5.0)
    place = (rover.north, rover.east)
    rover.go(place)
    rows = rover.drive(12.0)
    assert max(math.dist(row[:2], place) for row in rows) < 4.0
    assert abs(rover.speed) < 0.05


def test_offboard_drives_to_a_position_and_stops() -> None:
    rover = RoverBody("rover", NavState.OFFBOARD)
    rover.offboard(position=(15.0, 5.0, 0.0))
    rover.drive(14.0)
    assert math.dist((rover.north, rover.east), (15.0, 5.0)) < 0.6


def test_offboard_drives_at_a_velocity() -> None:
    rover = RoverBody("rover", NavState.OFFBOARD)
    rover.offboard(velocity=(0.0, 2.0, 0.0))
    north, _, heading, speed = rover.drive(8.0)[-1]
    assert math.degrees(heading) == pytest.approx(90.0, abs=1.0) and speed == pytest.approx(2.0, abs=0.1)
    rover.offboard(velocity=(0.0, 0.0, 0.0))
    assert rover.drive(4.0)[-1][3] == pytest.approx(0.0, abs=0.02)
    assert north < 5.0


def test_offboard_by_an_acceleration_alone_drives_on_at_the_last_velocity() -> None:
    """AckermannOffboardMode::offboardControl publishes for positions and velocities; the controllers stay the same."""
    rover = RoverBody("rover", NavState.OFFBOARD)
    rover.offboard(velocity=(0.0, 2.0, 0.0))
    rover.drive(4.0)
    rover.offboard(acceleration=(1.0, 0.0, 0.0))
    rover.heading = 0.0
    _, _, heading, speed = rover.drive(4.0)[-1]
    assert math.degrees(heading) == pytest.approx(90.0, abs=1.0) and speed == pytest.approx(2.0, abs=0.1)


def test_offboard_without_a_trajectory_stops() -> None:
    rover = RoverBody("rover", NavState.OFFBOARD)
    rover.topics.offboard_setpoint = OffboardSetpoint(1)
    assert rover.drive(1.0)[-1][3] == pytest.approx(0.0, abs=1e-6)


def sticks(mode: NavState, throttle: float, roll: float = 0.0) -> RoverBody:
    """PX4's rover with its sticks deflected."""
    rover = RoverBody("sihsim_rover_ackermann", mode)
    rover.topics.manual_control_setpoint = ManualControlSetpoint(1, True, roll=roll, throttle=throttle)
    return rover


def test_manual_passes_the_sticks_on() -> None:
    rover = sticks(NavState.MANUAL, 0.4, roll=-0.5)
    rover.drive(2.0)
    steering, motor = rover.topics.actuator_outputs.controls
    assert motor == pytest.approx(0.4) and steering == pytest.approx(-0.5)
    assert rover.topics.actuator_outputs.pwm == (1250, 1700)


def test_position_mode_drives_at_a_speed_and_turns_at_a_rate() -> None:
    rover = sticks(NavState.POSCTL, 0.6, roll=0.4)
    rows = rover.drive(3.0)
    assert rows[-1][3] == pytest.approx(1.8, abs=0.1)
    turned = math.remainder(rows[-1][2] - rows[-51][2], math.tau) / 0.2
    assert math.degrees(turned) == pytest.approx(180.0 * 0.3 / 0.9, rel=0.1)


def test_position_mode_keeps_to_its_line_also_backwards() -> None:
    rover = sticks(NavState.POSCTL, -0.5)
    rover.heading = 0.3
    rover.publish(0.0)
    row = rover.drive(6.0)[-1]
    assert row[3] == pytest.approx(-1.5, abs=0.1)
    assert row[2] == pytest.approx(0.3, abs=0.03)


def test_stabilized_mode_keeps_its_heading() -> None:
    rover = sticks(NavState.STAB, 0.5)
    rover.heading = -0.4
    rover.publish(0.0)
    assert rover.drive(4.0)[-1][2] == pytest.approx(-0.4, abs=0.02)


def test_without_reverse_the_motor_does_not_turn_backwards() -> None:
    rover = RoverBody("sihsim_rover_ackermann", NavState.MANUAL, CA_R_REV=0)
    rover.topics.manual_control_setpoint = ManualControlSetpoint(1, True, throttle=-0.5)
    rover.drive(1.0)
    assert (rover.topics.actuator_outputs.controls[1], rover.topics.actuator_outputs.pwm[1]) == (0.0, 900)
    rover.topics.manual_control_setpoint = ManualControlSetpoint(2, True, throttle=0.5)
    rover.drive(3.0)
    told = rover.topics.actuator_outputs
    assert told.controls[1] == pytest.approx(0.5) and told.pwm[1] == 1500


def test_steering_is_turned_round_by_pwm_main_rev() -> None:
    pwm = []
    for bits in (0, 1):
        rover = RoverBody("sihsim_rover_ackermann", NavState.MANUAL, PWM_MAIN_REV=bits)
        rover.topics.manual_control_setpoint = ManualControlSetpoint(1, True, roll=0.5, throttle=0.2)
        rover.drive(1.0)
        pwm.append(rover.topics.actuator_outputs.pwm)
    assert pwm == [(1750, 1600), (1250, 1600)]


def test_an_output_without_a_function_stands_at_its_disarmed_value() -> None:
    rover = RoverBody("sihsim_rover_ackermann", NavState.MANUAL)
    for output, function in enumerate((201, 0, 101), 1):
        rover.parameters.set(f"PWM_MAIN_FUNC{output}", function)
    rover.topics.manual_control_setpoint = ManualControlSetpoint(1, True, throttle=0.2)
    for _ in range(250):
        rover.now_us += 4000
        rover.control.update_rate(rover.now_us)
    assert rover.topics.actuator_outputs.pwm == (1500, 900, 1600)


def test_disarmed_it_stops_at_once() -> None:
    rover = RoverBody("rover")
    rover.go((40.0, 0.0))
    rover.drive(4.0)
    rover.topics.actuator_armed = ActuatorArmed(armed=False)
    rover.drive(0.02)
    assert rover.topics.actuator_outputs.controls == (0.0, 0.0)


def test_disarmed_it_is_told_to_stop_only_once() -> None:
    rover = RoverBody("rover")
    rover.drive(1.0)
    rover.topics.actuator_armed = ActuatorArmed(armed=False)
    rover.drive(0.02)
    told = rover.topics.actuator_outputs
    rover.drive(1.0)
    assert rover.topics.actuator_outputs is told


def test_terminated_it_is_told_nothing_and_does_on_what_it_did() -> None:
    """RoverAckermann::updateControllers: without flag_control_allocation_enabled no actuator_motors are published."""
    rover = sticks(NavState.MANUAL, 0.4)
    rover.drive(1.0)
    told = rover.topics.actuator_outputs
    rover.topics.vehicle_status = rover.topics.vehicle_status._replace(nav_state=NavState.TERMINATION)
    rover.drive(1.0)
    assert rover.topics.actuator_outputs is told and told.controls[1] == pytest.approx(0.4)


def test_outputs_say_nothing_before_a_throttle_was_ever_asked_for() -> None:
    """AckermannActControl::updateActControl: an attitude alone asks for none."""
    rover = RoverBody("sihsim_rover_ackermann", NavState.OFFBOARD)
    rover.topics.offboard_setpoint = OffboardSetpoint(1, attitude=VehicleAttitudeSetpoint(1))
    rover.control.update_rate(2_000_000)
    assert rover.topics.actuator_outputs.timestamp == 0
    rover.offboard(velocity=(1.0, 0.0, 0.0))
    rover.control.update_rate(3_000_000)
    assert rover.topics.actuator_outputs.timestamp == 3_000_000


def test_a_mode_of_aircraft_gives_nothing_new_to_do() -> None:
    rover = RoverBody("rover")
    rover.go((20.0, 0.0))
    rover.drive(4.0)
    rover.topics.vehicle_status = rover.topics.vehicle_status._replace(nav_state=NavState.ORBIT)
    rover.drive(10.0)
    assert rover.north == pytest.approx(20.0, abs=0.6)
    assert abs(rover.speed) < 0.05


def test_sticks_that_fall_silent_stay_as_they_were() -> None:
    rover = sticks(NavState.MANUAL, 0.4)
    rover.drive(1.0)
    lost = rover.topics.manual_control_setpoint._replace(valid=False)
    rover.topics.manual_control_setpoint = lost
    rover.drive(1.0)
    assert rover.topics.actuator_outputs.controls[1] == pytest.approx(0.4)


def test_offboard_does_not_begin_with_what_came_before_the_mode() -> None:
    """PX4 publishes a trajectory_setpoint only in OFFBOARD: before, it is the one of zeros."""
    rover = RoverBody("rover", NavState.OFFBOARD)
    rover.offboard(velocity=(2.0, 0.0, 0.0))
    status = rover.topics.vehicle_status
    rover.topics.vehicle_status = status._replace(nav_state_timestamp=rover.now_us + 500_000)
    assert rover.drive(2.0)[-1][3] == pytest.approx(0.0, abs=1e-6)
    rover.offboard(velocity=(2.0, 0.0, 0.0))
    assert rover.drive(4.0)[-1][3] == pytest.approx(2.0, abs=0.1)
