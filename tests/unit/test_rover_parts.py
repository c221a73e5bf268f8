"""Pure pursuit and the controllers that rovers share."""

import math

import pytest

from autopilot.control.pure_pursuit import lookahead_m, target_bearing
from autopilot.control.rover_control import (
    SpeedControl,
    approach_speed,
    arrival_speed,
    corner_angle,
    least_cornering_speed,
    slew,
    speed_limited_by_course,
)

START, TARGET = (0.0, 0.0), (20.0, 0.0)


def test_the_look_ahead_grows_with_speed_within_its_limits() -> None:
    assert lookahead_m(0.1, 1.0, 1.0, 10.0) == 1.0
    assert lookahead_m(-4.0, 1.0, 1.0, 10.0) == 4.0
    assert lookahead_m(40.0, 1.0, 1.0, 10.0) == 10.0


def test_on_the_line_it_heads_along_it() -> None:
    assert target_bearing(TARGET, START, (5.0, 0.0), 2.0) == pytest.approx(0.0)


def test_beside_the_line_it_heads_for_the_point_one_look_ahead_away() -> None:
    bearing = target_bearing(TARGET, START, (5.0, 1.0), 2.0)
    assert bearing == pytest.approx(math.atan2(-1.0, math.sqrt(3.0)))


def test_far_beside_the_line_it_heads_straight_for_it() -> None:
    assert target_bearing(TARGET, START, (5.0, -8.0), 2.0) == pytest.approx(math.pi / 2)


def test_near_the_target_it_heads_for_the_target() -> None:
    assert target_bearing(TARGET, START, (19.0, 0.5), 2.0) == pytest.approx(math.atan2(-0.5, 1.0))


def test_a_line_without_length_is_its_target() -> None:
    assert target_bearing(TARGET, TARGET, (0.0, 0.0), 2.0) == pytest.approx(0.0)


def test_who_has_passed_the_target_follows_the_line_on() -> None:
    assert target_bearing(TARGET, START, (24.0, 0.0), 2.0) == pytest.approx(0.0)


def test_a_slew_rate_of_none_is_at_once() -> None:
    assert slew(0.0, 1.0, 0.0, 0.1) == 1.0
    assert slew(0.0, 1.0, 2.0, 0.1) == pytest.approx(0.2)
    assert slew(0.0, -1.0, 2.0, 0.1) == pytest.approx(-0.2)


def test_the_angle_between_two_legs() -> None:
    assert corner_angle((0.0, 0.0), (1.0, 0.0), (2.0, 0.0)) == pytest.approx(math.pi)
    assert corner_angle((0.0, 0.0), (1.0, 0.0), (1.0, 5.0)) == pytest.approx(math.pi / 2)
    assert math.isnan(corner_angle((1.0, 0.0), (1.0, 0.0), (1.0, 5.0)))


def test_a_corner_is_taken_slower_the_sharper_it_is_and_an_end_is_stopped_at() -> None:
    assert arrival_speed(math.pi, 3.0, 1.0, 0.5, 2.5) == pytest.approx(2.5)
    assert arrival_speed(math.pi / 2, 3.0, 1.0, 0.5, 2.5) == pytest.approx(1.5)
    assert arrival_speed(math.nan, 3.0, 1.0, 0.5, 2.5) == 0.0
    assert arrival_speed(math.pi / 2, 3.0, -1.0, 0.5, 2.5) == 2.5


def test_a_wrong_course_is_driven_slowly() -> None:
    assert speed_limited_by_course(3.0, math.radians(90.0), 3.2, 1.0, 0.5) == pytest.approx(1.6)
    assert speed_limited_by_course(-3.0, math.radians(-90.0), 3.2, 1.0, 0.5) == pytest.approx(-1.6)
    assert speed_limited_by_course(3.0, math.pi, 3.2, 0.0, 0.5) == 3.0


def test_but_no_slower_than_it_takes_to_turn_as_fast_as_it_may() -> None:
    # sihsim_rover_ackermann: 0.321 m of wheelbase, 180 deg/s, 30 degrees of steering
    least = least_cornering_speed(0.321, math.pi, math.radians(30.0))
    assert least == pytest.approx(1.747, abs=1e-3)
    assert speed_limited_by_course(3.0, math.pi, 3.2, 1.0, least) == least
    assert arrival_speed(0.1, 3.2, 1.0, least, 3.0) == least
    assert arrival_speed(0.1, 3.2, 1.0, least, 1.0) == least


def test_the_approach_slows_down_only_with_limits_to_plan_by() -> None:
    assert approach_speed(10.0, 0.0, 10.0, 3.0) < math.sqrt(2.0 * 3.0 * 10.0)
    assert approach_speed(10.0, 0.0, -1.0, 3.0) == math.inf
    assert approach_speed(-1.0, 0.7, 10.0, 3.0) == pytest.approx(0.7)


def test_speed_control_feeds_forward_corrects_and_forgets_its_integral_when_it_stops() -> None:
    control = SpeedControl()
    control.full_throttle_speed, control.pid.gain_p, control.pid.gain_i = 3.0, 0.1, 0.5
    assert control.update(1.5, 1.5, 0.01) == pytest.approx(0.5)
    assert control.update(1.5, 0.5, 0.01) == pytest.approx(0.6, abs=0.01)
    for _ in range(100):
        control.update(1.5, 0.5, 0.01)
    assert control.update(1.5, 1.5, 0.01) > 0.9
    assert control.update(0.0, 1.5, 0.01) == 0.0
    assert control.pid.integral == 0.0
