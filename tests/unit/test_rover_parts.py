"""Pure pursuit, the controllers that rovers share, and what an Ackermann rover makes of a corner."""

import math

import pytest

from sitl_emu.autopilot.control.ackermann_modes import acceptance_radius_m
from sitl_emu.autopilot.control.pure_pursuit import lookahead_m, target_bearing
from sitl_emu.autopilot.control.rover_control import (
    HeadingControl,
    Pid,
    Slew,
    SpeedControl,
    arrival_speed,
    corner_angle,
    speed_limited_by_course,
)
from sitl_emu.autopilot.control.rover_parameters import rover_parameters
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.vehicle_kind import VehicleKind

START, TARGET = (0.0, 0.0), (20.0, 0.0)
NAN = math.nan


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


def test_far_beside_its_ends_it_heads_for_them() -> None:
    assert target_bearing(TARGET, START, (-6.0, -8.0), 2.0) == pytest.approx(math.atan2(8.0, 6.0))
    assert target_bearing(TARGET, START, (26.0, -8.0), 2.0) == pytest.approx(math.atan2(8.0, -6.0))


def test_near_the_target_it_heads_for_the_target() -> None:
    assert target_bearing(TARGET, START, (19.0, 0.5), 2.0) == pytest.approx(math.atan2(-0.5, 1.0))


def test_a_line_without_length_is_its_target() -> None:
    assert target_bearing(TARGET, TARGET, (0.0, 0.0), 2.0) == pytest.approx(0.0)


def test_who_has_passed_the_target_follows_the_line_on() -> None:
    assert target_bearing(TARGET, START, (24.0, 0.0), 2.0) == pytest.approx(0.0)


def test_a_slew_rate_of_none_is_at_once() -> None:
    slew = Slew()
    assert slew.towards(1.0, 0.0, 0.0, 0.1) == 1.0
    assert slew.towards(0.0, 2.0, 1.0, 0.1) == pytest.approx(0.8)
    assert slew.towards(-1.0, 2.0, 0.8, 0.1) == pytest.approx(0.6)


def test_a_slew_rate_does_not_hold_back_who_is_nearer_already() -> None:
    assert Slew().towards(1.0, 2.0, 0.9, 0.1) == 1.0


def test_a_pid_stops_learning_at_its_limit() -> None:
    pid = Pid()
    assert pid.update(1.0, 0.5, 10.0, 1.0, 0.1) == 0.5
    assert pid.update(1.0, 0.5, 10.0, 1.0, 0.1) == 1.0
    assert pid.integral == 1.0
    assert pid.update(-0.1, 0.5, 10.0, 1.0, 0.1) == pytest.approx(0.95)
    assert pid.integral == pytest.approx(0.9)


def test_a_heading_is_sought_the_short_way_round() -> None:
    control = HeadingControl()
    assert control.update(-3.0, 3.0, 0.0, 5.0, 1.0, 0.01) == 1.0
    assert control.update(3.1, 3.0, 0.0, 5.0, 1.0, 0.01) == pytest.approx(0.5)


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
    parameters = rover_parameters(
        Parameters(
            VehicleKind.ROVER_ACKERMANN,
            {"RA_WHEEL_BASE": 0.321, "RO_YAW_RATE_LIM": 180.0, "RA_MAX_STR_ANG": math.radians(30.0)},
        )
    )
    least = parameters.least_cornering_speed
    assert least == pytest.approx(1.747, abs=1e-3)
    assert speed_limited_by_course(3.0, math.pi, 3.2, 1.0, least) == least
    assert arrival_speed(0.1, 3.2, 1.0, least, 3.0) == least
    assert arrival_speed(0.1, 3.2, 1.0, least, 1.0) == least


def test_speed_control_feeds_forward_corrects_and_forgets_its_integral_when_it_stops() -> None:
    control = SpeedControl()

    def throttle(wanted: float, speed: float) -> float:
        return control.update(wanted, speed, (0.0, 0.0), 3.0, (0.1, 0.5), 0.01)

    assert throttle(1.5, 1.5) == pytest.approx(0.5)
    assert throttle(1.5, 0.5) == pytest.approx(0.6, abs=0.01)
    for _ in range(100):
        throttle(1.5, 0.5)
    assert throttle(1.5, 1.5) > 0.9
    assert throttle(0.0, 1.5) == 0.0
    assert control.pid.integral == 0.0


@pytest.mark.parametrize(
    ("angle_deg", "acceptance_m", "radius_m"),
    [(90.0, 0.5, 1.284), (180.0, 0.5, 0.5), (1.0, 0.5, 3.0), (90.0, 2.0, 2.0), (NAN, 0.5, 0.5)],
)
def test_a_corner_counts_as_reached_where_the_turning_circle_touches_its_legs(
    angle_deg: float, acceptance_m: float, radius_m: float
) -> None:
    reference = {
        "RA_WHEEL_BASE": 0.321,
        "RA_MAX_STR_ANG": math.radians(30.0),
        "RA_ACC_RAD_GAIN": 2.0,
        "RA_ACC_RAD_MAX": 3.0,
    }
    parameters = rover_parameters(Parameters(VehicleKind.ROVER_ACKERMANN, {**reference, "NAV_ACC_RAD": acceptance_m}))
    assert acceptance_radius_m(math.radians(angle_deg), parameters) == pytest.approx(radius_m, abs=1e-3)
