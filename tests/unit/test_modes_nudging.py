"""Sticks in modes that fly by themselves: MPC_AUTO_NUDGING."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.modes.trajectory_constraints import max_distance_to_circle
from sitl_emu.autopilot.topics import ManualControlSetpoint
from tests.unit.modes_follower import Follower

TURNS, LANDS = 1, 2


def hold(follower: Follower, seconds: float, **sticks: Any) -> None:
    """Deflect sticks for a time, and then let go of them."""
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True, **sticks)
    follower.fly(seconds)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True)


def enter(follower: Follower, nav_state: NavState) -> None:
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=nav_state)


def landing(**changes: float) -> Follower:
    """A vehicle that begins to land where it is, 30 m up."""
    follower = Follower(30.0, NavState.AUTO_LAND, **{"MPC_AUTO_NUDGING": LANDS, **changes})
    follower.go((0.0, 0.0, 0.0), kind=SetpointType.LAND)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True)
    follower.fly(3.0)
    return follower


@pytest.mark.parametrize(("bits", "turned"), [(0, False), (LANDS, False), (TURNS, True)])
def test_the_yaw_stick_turns_where_it_may_and_the_heading_stays(bits: int, turned: bool) -> None:
    follower = Follower(MPC_AUTO_NUDGING=bits)
    follower.go((500.0, 0.0, 10.0))
    follower.fly(5.0)
    hold(follower, 1.0, yaw=0.5)
    row = follower.fly(3.0)[-1]
    assert (row.local.heading > 0.3) is turned
    assert follower.fly(2.0)[-1].local.heading == pytest.approx(row.local.heading, abs=0.01)
    follower.go((0.0, -500.0, 10.0))
    assert (abs(follower.fly(10.0)[-1].local.heading - row.local.heading) < 0.01) is turned


def test_another_mode_or_another_yaw_of_the_navigator_takes_the_heading_back() -> None:
    follower = Follower(MPC_AUTO_NUDGING=TURNS)
    follower.go((0.0, 0.0, 10.0), yaw=0.2)
    follower.fly(2.0)
    hold(follower, 1.0, yaw=-1.0)
    assert follower.fly(6.0)[-1].local.heading < -0.3
    follower.go((0.0, 0.0, 10.0), yaw=0.3)
    assert follower.fly(8.0)[-1].local.heading == pytest.approx(0.3, abs=0.01)
    hold(follower, 1.0, yaw=-1.0)
    assert follower.fly(6.0)[-1].local.heading < -0.3
    enter(follower, NavState.AUTO_MISSION)
    assert follower.fly(8.0)[-1].local.heading == pytest.approx(0.3, abs=0.01)


def test_without_sticks_the_heading_is_the_mode_s_again() -> None:
    follower = Follower(MPC_AUTO_NUDGING=TURNS)
    follower.go((0.0, 0.0, 10.0), yaw=0.2)
    hold(follower, 1.0, yaw=1.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(3, False)
    assert follower.fly(8.0)[-1].local.heading == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize(("bits", "moved"), [(0, False), (TURNS, False), (LANDS, True)])
def test_pitch_and_roll_move_a_landing_where_they_may(bits: int, moved: bool) -> None:
    follower = landing(MPC_AUTO_NUDGING=bits)
    hold(follower, 2.0, pitch=0.5, roll=0.5)
    follower.fly(4.0)
    local = follower.topics.vehicle_local_position
    assert (local.x > 1.0 and local.y > 1.0) is moved
    assert math.hypot(local.vx, local.vy) < 0.05
    after = follower.fly(2.0)[-1].local
    assert (after.x, after.y) == pytest.approx((local.x, local.y), abs=0.1)
    assert after.vz > 0.5


def test_a_landing_that_sticks_moved_once_leaves_the_next_one_where_it_is() -> None:
    """PX4 makes FlightTaskAuto anew when an AUTO mode is entered, and with it what the sticks accelerate."""
    follower = landing()
    hold(follower, 2.0, pitch=1.0)
    enter(follower, NavState.POSCTL)
    stopped = follower.fly(6.0)[-1].local
    enter(follower, NavState.AUTO_LAND)
    follower.go((stopped.x, stopped.y, 0.0), kind=SetpointType.LAND)
    assert max(abs(row.local.x - stopped.x) for row in follower.fly(3.0)) < 0.05


def test_pitch_is_seen_from_the_heading_and_the_yaw_stick_turns_a_landing() -> None:
    follower = landing()
    hold(follower, 2.0, yaw=0.5)
    heading = follower.fly(3.0)[-1].local.heading
    assert heading > 0.3
    hold(follower, 2.0, pitch=0.5)
    local = follower.fly(4.0)[-1].local
    assert math.atan2(local.y, local.x) == pytest.approx(heading, abs=0.1)


def test_a_landing_moves_no_farther_than_its_radius() -> None:
    """MPC_LAND_RADIUS, from where the landing was to be: there it brakes as sticks do, and may but go back."""
    follower = landing(MPC_LAND_RADIUS=5.0)
    hold(follower, 5.0, pitch=1.0)
    edge = follower.fly(0.2)[-1].local
    assert 5.0 < edge.x < 8.0 and edge.vx < 0.05
    hold(follower, 2.0, pitch=1.0)
    assert follower.topics.vehicle_local_position.x == pytest.approx(edge.x, abs=0.1)
    hold(follower, 2.0, pitch=-1.0)
    assert follower.fly(3.0)[-1].local.x < edge.x - 1.0


@pytest.mark.parametrize(("throttle", "share"), [(1.0, 0.0), (0.0, 1.0), (-1.0, 2.0)])
def test_throttle_stops_a_landing_or_makes_it_twice_as_fast(throttle: float, share: float) -> None:
    follower = landing(MPC_LAND_ALT1=40.0, MPC_LAND_ALT2=40.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True, throttle=throttle)
    follower.fly(4.0)
    assert follower.topics.vehicle_local_position.vz == pytest.approx(0.7 * share, abs=0.02)


@pytest.mark.parametrize("bits", [0, LANDS])
def test_sticks_fly_a_descent_without_a_position_where_they_may(bits: int) -> None:
    follower = Follower(60.0, NavState.DESCEND, MPC_AUTO_NUDGING=bits)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True, 0.0, 1.0, 0.5, -1.0)
    setpoint = follower.fly(2.0)[-1].setpoint
    speed = follower.parameters["MPC_LAND_SPEED"]
    if not bits:
        assert setpoint.velocity[2] == speed and setpoint.acceleration[:2] == (0.0, 0.0)
        assert setpoint.yaw == 0.0 and math.isnan(setpoint.yawspeed)
        return
    assert setpoint.velocity[2] == pytest.approx(2.0 * speed)
    tilt = math.atan(math.hypot(*setpoint.acceleration[:2]) / 9.80665)
    assert math.degrees(tilt) == pytest.approx(follower.parameters["MPC_MAN_TILT_MAX"], abs=0.5)
    assert setpoint.yawspeed > 0.1
    follower.topics.vehicle_local_position = follower.topics.vehicle_local_position._replace(v_z_valid=False)
    setpoint = follower.fly(0.1)[-1].setpoint
    assert math.isnan(setpoint.velocity[2]) and setpoint.acceleration[2] == pytest.approx(10.3)


@pytest.mark.parametrize(
    ("place", "direction", "distance"),
    [
        ((0.0, 0.0), (0.0, 2.0), 5.0),
        ((3.0, 0.0), (1.0, 0.0), 2.0),
        ((-8.0, 0.0), (1.0, 0.0), 13.0),
        ((8.0, 0.0), (1.0, 0.0), 0.0),
        ((8.0, 0.0), (0.0, 1.0), math.nan),
        ((0.0, 0.0), (0.0, 0.0), math.nan),
    ],
)
def test_how_far_it_is_out_of_a_circle(
    place: tuple[float, float], direction: tuple[float, float], distance: float
) -> None:
    assert max_distance_to_circle(place, (0.0, 0.0), 5.0, direction) == pytest.approx(distance, nan_ok=True)
