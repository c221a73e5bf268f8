"""AUTO_FOLLOW_TARGET: where a vehicle is to be that follows something."""

import math

import pytest

from autopilot.constants import NavState
from autopilot.topics import FollowTarget

from .modes_follower import ALTITUDE_M, HOME, Follower


def follow(follower: Follower, seconds: float, place: tuple[float, float], speed: tuple[float, float]) -> None:
    """Let a target go on from a place, told at 5 Hz."""
    for step in range(round(seconds * 5)):
        north, east = place[0] + speed[0] * step / 5, place[1] + speed[1] * step / 5
        lat, lon = HOME.reproject(north, east)
        velocity = (*speed, 0.0)
        follower.topics.follow_target = FollowTarget(follower.now_us, lat, lon, ALTITUDE_M, velocity)
        follower.fly(0.2)


def test_behind_a_target_that_moves() -> None:
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(1.0)
    follow(follower, 40.0, (20.0, 0.0), (3.0, 0.0))
    local = follower.topics.vehicle_local_position
    target_north = 20.0 + 3.0 * 40.0
    assert (local.x, local.y, -local.z) == pytest.approx((target_north - 8.0, 0.0, 8.0), abs=1.5)
    assert local.vx == pytest.approx(3.0, abs=0.3)
    assert follower.topics.trajectory_setpoint.yaw == pytest.approx(0.0, abs=0.05)


def test_at_the_right_and_farther_where_parameters_say_so() -> None:
    follower = Follower(
        up=12.0, nav_state=NavState.AUTO_FOLLOW_TARGET, FLW_TGT_FA=90.0, FLW_TGT_DST=15.0, FLW_TGT_HT=12.0
    )
    follower.fly(1.0)
    follow(follower, 60.0, (20.0, 0.0), (0.0, 2.0))
    local = follower.topics.vehicle_local_position
    # course east, so its right is south
    assert (local.x, local.y) == pytest.approx((20.0 - 15.0, 120.0), abs=1.5)
    assert -local.z == pytest.approx(12.0, abs=0.5)
    assert follower.topics.trajectory_setpoint.yaw == pytest.approx(0.0, abs=0.1)


def test_first_the_height_then_the_place() -> None:
    follower = Follower(up=20.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(1.0)
    follow(follower, 4.0, (50.0, 0.0), (0.0, 0.0))
    assert abs(follower.topics.vehicle_local_position.x) < 1.0
    assert -follower.topics.vehicle_local_position.z < 19.0


def test_a_target_that_stands_keeps_the_angle() -> None:
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(1.0)
    follow(follower, 30.0, (0.0, 40.0), (0.0, 0.0))
    local = follower.topics.vehicle_local_position
    assert (local.x, local.y) == pytest.approx((0.0, 32.0), abs=0.5)
    assert follower.topics.trajectory_setpoint.yaw == pytest.approx(math.pi / 2.0, abs=0.05)


def test_without_a_target_it_hovers() -> None:
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(10.0)
    local = follower.topics.vehicle_local_position
    assert (local.x, local.y, -local.z) == pytest.approx((0.0, 0.0, 8.0), abs=0.2)


def test_a_target_that_falls_silent_is_taken_to_stand() -> None:
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(1.0)
    follow(follower, 20.0, (20.0, 0.0), (3.0, 0.0))
    follower.fly(20.0)
    local = follower.topics.vehicle_local_position
    assert math.hypot(local.vx, local.vy) < 0.1
    assert local.x < 20.0 + 60.0 + 3.0 * 4.0


def test_the_place_changes_no_faster_than_it_may() -> None:
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET, FLW_TGT_MAX_VEL=2.0)
    follower.fly(1.0)
    follow(follower, 10.0, (100.0, 0.0), (0.0, 0.0))
    assert math.hypot(follower.topics.vehicle_local_position.vx, follower.topics.vehicle_local_position.vy) < 2.2
