"""Collision prevention: POSCTL stops before what OBSTACLE_DISTANCE tells of."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import DistanceSensorSample, ManualControlSetpoint, ObstacleDistance

from .modes_follower import Follower

UNKNOWN = 65535
BODY_FRD, LOCAL_NED = 12, 1


def fly_at_wall(follower: Follower, wall_north_m: float, seconds: float, frame: int = BODY_FRD) -> None:
    """Full stick ahead, towards a wall that a sensor all around tells of at 10 Hz."""
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0)
    for _ in range(round(seconds * 10)):
        ahead_m = wall_north_m - follower.topics.vehicle_local_position.x
        distances = []
        for index in range(72):
            cosine = math.cos(math.radians(index * 5))
            away_m = ahead_m / cosine if cosine > 0.1 else math.inf
            distances.append(round(min(away_m, 20.01) * 100) if away_m > 0 else 0)
        follower.topics.obstacle_distance = ObstacleDistance(
            follower.now_us, frame, tuple(distances), 5.0, 20, 2000, 0.0
        )
        follower.fly(0.1)


@pytest.mark.parametrize("frame", [BODY_FRD, LOCAL_NED])
def test_it_stops_before_a_wall(frame: int) -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    fly_at_wall(follower, 40.0, 25.0, frame)
    local = follower.topics.vehicle_local_position
    assert 30.0 < local.x < 37.0
    assert abs(local.vx) < 0.3
    told = follower.topics.obstacle_distance_fused
    assert told.distances[0] == pytest.approx((40.0 - local.x) * 100.0, abs=100.0)
    assert (told.frame, told.increment, told.min_distance, told.max_distance) == (BODY_FRD, 5.0, 20, 2000)


def test_it_flies_into_it_where_prevention_is_off() -> None:
    follower = Follower(nav_state=NavState.POSCTL)
    fly_at_wall(follower, 40.0, 10.0)
    assert follower.topics.vehicle_local_position.x > 50.0


def test_without_data_it_does_not_move() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0)
    follower.fly(5.0)
    assert abs(follower.topics.vehicle_local_position.x) < 0.1


@pytest.mark.parametrize(("goes", "moved"), [(0, False), (1, True)])
def test_where_nothing_is_known_it_goes_only_if_it_may(goes: int, moved: bool) -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0, CP_GO_NO_DATA=goes, CP_GUIDE_ANG=0.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0)
    for _ in range(50):
        # A sensor that looks backwards alone
        follower.topics.distance_sensor_sideways = DistanceSensorSample(follower.now_us, 9.0, 0.2, 10.0, 4, 0.5)
        follower.fly(0.1)
    assert (follower.topics.vehicle_local_position.x > 5.0) is moved


def test_away_from_the_wall_it_is_free() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    fly_at_wall(follower, 40.0, 20.0)
    near = follower.topics.vehicle_local_position.x
    for _ in range(50):
        follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=-1.0)
        distances = tuple(400 if index in (0, 1, 71) else 2001 for index in range(72))
        follower.topics.obstacle_distance = ObstacleDistance(follower.now_us, BODY_FRD, distances, 5.0, 20, 2000, 0.0)
        follower.fly(0.1)
    assert follower.topics.vehicle_local_position.x < near - 10.0


def test_nonsense_breaks_nothing() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0, CP_GUIDE_ANG=90.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0, roll=-1.0)
    for frame in (0, 1, 12, 99):
        for increment in (0.0, 1e-9, 400.0):
            follower.topics.obstacle_distance = ObstacleDistance(
                follower.now_us, frame, (0, 65534) * 36, increment, 65535, 0, 1e9
            )
            row = follower.fly(0.1)[-1]
            assert all(math.isfinite(value) for value in row.setpoint.velocity)
