"""AUTO_FOLLOW_TARGET: where a vehicle is to be that follows something."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.modes.target_estimator import TargetEstimator
from sitl_emu.autopilot.topics import FollowTarget

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


@pytest.mark.parametrize("unknown", [math.nan, math.inf])
def test_behind_a_target_that_tells_positions_alone(unknown: float) -> None:
    """MAVSDK's set_target_location without velocities: one position a second, 2 m/s to the north."""
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(1.0)
    for second in range(60):
        lat, lon = HOME.reproject(20.0 + 2.0 * second, 0.0)
        velocity = (unknown, unknown, unknown)
        follower.topics.follow_target = FollowTarget(follower.now_us, lat, lon, ALTITUDE_M, velocity)
        follower.fly(1.0)
    local = follower.topics.vehicle_local_position
    assert 20.0 + 2.0 * 60 - local.x == pytest.approx(8.0, abs=2.0)
    assert local.vx == pytest.approx(2.0, abs=0.5)
    assert abs(local.y) < 0.5


def test_a_target_told_without_sense_is_forgotten_until_it_is_told_again() -> None:
    estimator, local = TargetEstimator(), Follower(up=8.0).topics.vehicle_local_position
    for now_us, alt in ((1_000_000, math.nan), (2_000_000, 3e38), (3_000_000, ALTITUDE_M)):
        estimator.predict(now_us, 0.008)
        estimator.fuse(now_us, FollowTarget(now_us, *HOME.reproject(20.0, 0.0), alt, (1e300, 0.0, 0.0)), local)
    assert not estimator.valid or all(map(math.isfinite, (*estimator.position, *estimator.velocity)))
    estimator.reset()
    estimator.fuse(4_000_000, FollowTarget(4_000_000, *HOME.reproject(20.0, 0.0), ALTITUDE_M), local)
    assert estimator.position == pytest.approx((20.0, 0.0, 0.0), abs=0.01)
    assert estimator.velocity == (0.0, 0.0, 0.0)


def test_a_position_that_is_sent_again_at_once_is_no_news() -> None:
    """QGroundControl repeats a phone's place several times a second."""
    estimator, local = TargetEstimator(), Follower(up=8.0).topics.vehicle_local_position

    def tell(now_us: int, north_m: float) -> float:
        estimator.fuse(now_us, FollowTarget(now_us, *HOME.reproject(north_m, 0.0), ALTITUDE_M), local)
        return estimator.position[0]

    first = tell(10_000_000, 20.0)
    assert tell(10_400_000, 30.0) == first
    assert tell(10_600_000, 20.0) == first
    assert tell(10_700_000, 30.0) > first


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
