"""The trajectory generator: limits are kept, velocities and places are reached."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.autopilot.modes.heading_smoothing import HeadingSmoothing
from sitl_emu.autopilot.modes.position_smoothing import PositionSmoothing
from sitl_emu.autopilot.modes.trajectory_constraints import (
    Limits,
    max_speed_from_distance,
    max_speed_in_waypoint,
    speed_through,
)
from sitl_emu.autopilot.modes.velocity_smoothing import VelocitySmoothing, time_synchronization
from sitl_emu.core.geodesy import wrap_pi

JERK, ACCELERATION = 4.0, 3.0
DT = 0.008
NAN3 = (math.nan, math.nan, math.nan)
speeds = st.floats(-12.0, 12.0)
accelerations = st.floats(-ACCELERATION, ACCELERATION)


def axis(velocity: float = 0.0, acceleration: float = 0.0) -> VelocitySmoothing:
    """An axis with the limits of these tests."""
    smoothing = VelocitySmoothing(max_velocity=20.0)
    smoothing.max_jerk, smoothing.max_acceleration = JERK, ACCELERATION
    smoothing.reset(0.0, velocity, acceleration)
    return smoothing


@settings(max_examples=30)
@given(speeds, accelerations, speeds)
def test_a_plan_ends_at_its_velocity_without_acceleration(start: float, acceleration: float, target: float) -> None:
    smoothing = axis(start, acceleration)
    smoothing.update_durations(target)
    smoothing.update_trajectory(smoothing.total_time_s + 0.1)
    assert smoothing.velocity == pytest.approx(target, abs=1e-3)
    assert smoothing.acceleration == 0.0


@settings(max_examples=30)
@given(speeds, accelerations, speeds)
def test_acceleration_and_jerk_stay_within_their_limits(start: float, acceleration: float, target: float) -> None:
    smoothing = axis(start, acceleration)
    before = acceleration
    for _ in range(300):
        smoothing.update_trajectory(DT)
        assert abs(smoothing.acceleration) <= ACCELERATION + 1e-6
        assert abs(smoothing.acceleration - before) <= JERK * DT + 1e-4
        before = smoothing.acceleration
        smoothing.update_durations(target)


def test_a_velocity_from_rest_takes_the_time_of_a_trapezoid() -> None:
    smoothing = axis()
    smoothing.update_durations(5.0)
    assert smoothing.total_time_s == pytest.approx(5.0 / ACCELERATION + ACCELERATION / JERK)


def test_axes_synchronized_end_together() -> None:
    quick, slow = axis(), axis()
    quick.update_durations(1.0)
    slow.update_durations(8.0)
    total = slow.total_time_s
    time_synchronization((quick, slow))
    assert quick.total_time_s == pytest.approx(total)
    quick.update_trajectory(total)
    assert quick.velocity == pytest.approx(1.0, abs=1e-3)


@settings(max_examples=40)
@given(st.floats(0.5, 80.0), st.floats(0.0, 3.0))
def test_one_can_brake_within_the_distance(distance: float, final: float) -> None:
    speed = max_speed_from_distance(JERK, ACCELERATION, distance, final)
    assert speed >= final
    braking = (speed * speed - final * final) / (2.0 * ACCELERATION) + speed * 2.0 * ACCELERATION / JERK
    assert braking == pytest.approx(distance, rel=1e-6) or speed == final


def test_the_speed_in_a_corner_is_that_of_the_circle_that_touches_both_legs() -> None:
    right_angle = max_speed_in_waypoint(math.pi / 2, 1.5, 10.0)
    radius = 10.0 * math.tan(math.pi / 4)
    assert right_angle**2 / radius == pytest.approx(1.5)
    assert max_speed_in_waypoint(0.2, 1.5, 10.0) < right_angle


def test_a_straight_line_through_a_waypoint_is_flown_at_full_speed_and_a_reversal_is_not() -> None:
    limits = Limits(2.0, 5.0, ACCELERATION, JERK, 0.5)
    here, corner = (0.0, 0.0, -10.0), (3.0, 0.0, -10.0)
    assert speed_through(here, corner, (60.0, 0.0, -10.0), limits) == pytest.approx(5.0)
    assert speed_through(here, corner, (-60.0, 0.0, -10.0), limits) < 2.0
    assert speed_through(here, corner, corner, limits) < 2.0


def test_the_speed_at_a_waypoint_knows_no_heights() -> None:
    limits = Limits(2.0, 5.0, ACCELERATION, JERK, 0.5)
    here, corner = (0.0, 0.0, -7.0), (3.0, 0.0, -10.0)
    assert speed_through(here, corner, (60.0, 0.0, -30.0), limits) == pytest.approx(5.0)


def test_a_trajectory_arrives_without_overshoot_in_both_directions() -> None:
    smoothing = PositionSmoothing()
    smoothing.set_horizontal_limits(12.0, ACCELERATION, JERK)
    smoothing.set_vertical_limits(3.0, 4.0)
    target = (30.0, -12.0, -6.0)
    for _ in range(2500):
        here = (smoothing.x.position, smoothing.y.position, smoothing.z.position)
        smoothing.update(here, ((0.0, 0.0, 0.0), target, target), NAN3, DT)
        assert smoothing.x.position < 30.01 and smoothing.z.position > -6.01
    assert (smoothing.x.position, smoothing.y.position, smoothing.z.position) == pytest.approx(target, abs=0.05)


def test_the_trajectory_waits_for_a_vehicle_that_lags_behind() -> None:
    smoothing = PositionSmoothing()
    smoothing.set_horizontal_limits(12.0, ACCELERATION, JERK)
    target = (30.0, 0.0, 0.0)
    for _ in range(2000):
        smoothing.update((0.0, 0.0, 0.0), ((0.0, 0.0, 0.0), target, target), NAN3, DT)
    assert 1.0 < smoothing.x.position <= smoothing.max_xy_error_m


def test_the_height_waits_by_itself_and_not_at_all_without_a_limit() -> None:
    smoothing = PositionSmoothing()
    smoothing.set_horizontal_limits(12.0, ACCELERATION, JERK)
    smoothing.set_vertical_limits(3.0, 4.0)
    target = (30.0, 0.0, -20.0)
    for _ in range(2000):
        smoothing.update((smoothing.x.position, 0.0, 0.0), ((0.0, 0.0, 0.0), target, target), NAN3, DT)
    assert smoothing.x.position == pytest.approx(30.0, abs=0.05)
    assert 0.5 < -smoothing.z.position <= smoothing.max_z_error_m
    smoothing.max_z_error_m = 0.0
    for _ in range(2000):
        smoothing.update((30.0, 0.0, 0.0), ((0.0, 0.0, 0.0), target, target), NAN3, DT)
    assert smoothing.z.position == pytest.approx(-20.0, abs=0.05)


def test_a_turning_trajectory_climbs_as_its_leg_does() -> None:
    smoothing = PositionSmoothing()
    smoothing.set_horizontal_limits(12.0, ACCELERATION, JERK)
    smoothing.set_vertical_limits(3.0, 4.0)
    smoothing.reset((0.0, 0.0, -10.0), (3.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    # The leg goes east and climbs to 30 m; the vehicle is above it here, and goes north.
    legs = ((0.0, 0.0, 0.0), (0.0, 60.0, -30.0), (0.0, 60.0, -30.0))
    smoothing.update((0.0, 0.0, -10.0), legs, NAN3, DT)
    assert smoothing.unsmoothed_velocity[2] > 0.0


def test_who_has_to_turn_to_a_landing_aims_at_where_the_leg_began() -> None:
    """As a real PX4 that was sent to land 40 m away out of another course: it came down where its leg began."""
    smoothing = PositionSmoothing()
    smoothing.set_horizontal_limits(12.0, 3.0, 4.0)
    smoothing.set_vertical_limits(1.5, 3.0)
    smoothing.reset((0.0, 0.0, -10.0), (0.0, 3.0, 0.0), (0.0, 0.0, 0.0))
    landing = ((2.0, -8.0, -10.0), (-40.0, 20.0, math.nan), (-40.0, 20.0, 0.0))
    smoothing.update((0.0, 0.0, -10.0), landing, (math.nan, math.nan, 0.7), DT)
    north, east, down = smoothing.unsmoothed_velocity
    assert (north, east) == pytest.approx((0.0, 0.0))  # the speed on the last straight, of which there was none
    smoothing._straight_speed = 5.0
    smoothing.update((0.0, 0.0, -10.0), landing, (math.nan, math.nan, 0.7), DT)
    north, east, down = smoothing.unsmoothed_velocity
    assert math.atan2(east, north) == pytest.approx(math.atan2(-8.0, 2.0), abs=0.01)
    assert down == 0.7


def test_to_a_single_place_it_aims_at_once_however_it_moves() -> None:
    """PositionSmoothing::generateSetpoints with one waypoint: no L1 point, and no speed of before it turned."""
    smoothing = PositionSmoothing(is_single=True)
    smoothing.set_horizontal_limits(12.0, ACCELERATION, JERK)
    smoothing.reset((0.0, 0.0, -10.0), (0.0, 3.0, 0.0), (0.0, 0.0, 0.0))
    smoothing.update((0.0, 0.0, -10.0), ((30.0, -40.0, -10.0),) * 3, NAN3, DT)
    assert smoothing.unsmoothed_velocity == pytest.approx((3.0, -4.0, 0.0))


def test_a_heading_turns_the_short_way_within_its_rate() -> None:
    heading = HeadingSmoothing()
    heading.set_limits(math.radians(60.0), math.radians(20.0))
    heading.reset(math.radians(170.0))
    fastest = 0.0
    for _ in range(700):
        heading.update(math.radians(-150.0), DT)
        fastest = max(fastest, heading.rate)
        assert heading.rate > -1e-6
    assert math.degrees(heading.heading) == pytest.approx(-150.0, abs=0.1)
    assert math.degrees(fastest) == pytest.approx(math.sqrt(40.0 * 20.0), rel=0.03)


def test_a_heading_begins_to_turn_in_the_step_in_which_it_is_asked_to() -> None:
    """HeadingSmoothing::update plans, then steps (MPC_YAWRAUTO_ACC of 20 degrees/s²)."""
    heading = HeadingSmoothing()
    heading.set_limits(math.radians(60.0), math.radians(20.0))
    heading.reset(0.0)
    heading.update(1.0, DT)
    assert heading.rate == pytest.approx(math.radians(20.0) * DT)


def test_a_heading_that_jumps_with_the_estimate_turns_on_at_its_rate() -> None:
    """HeadingSmoothing::reset without a rate (FlightTaskAuto::_ekfResetHandlerHeading)."""
    heading = HeadingSmoothing()
    heading.set_limits(math.radians(60.0), math.radians(20.0))
    heading.reset(0.0)
    for _ in range(150):
        heading.update(2.0, DT)
    before, rate = heading.heading, heading.rate
    heading.turned(3.0)
    assert heading.heading == pytest.approx(wrap_pi(before + 3.0)) and heading.rate == rate
    heading.update(wrap_pi(2.0 + 3.0), DT)
    assert heading.heading == pytest.approx(wrap_pi(before + 3.0 + rate * DT), abs=1e-4)
