"""AUTO_FOLLOW_TARGET: where a vehicle is to be that follows something."""

import itertools
import math
from typing import Any

import pytest

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.constants import NavState, TakeoffState
from sitl_emu.autopilot.modes.second_order_reference_model import SecondOrderReferenceModel
from sitl_emu.autopilot.modes.target_estimator import TargetEstimator
from sitl_emu.autopilot.payload.gimbal import Gimbal
from sitl_emu.autopilot.topics import FollowTarget, ManualControlSetpoint, TakeoffStatus, VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import euler

from .modes_follower import ALTITUDE_M, HOME, STEP_S, Follower


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
    follower = Follower(up=60.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(1.0)
    follow(follower, 2.0, (50.0, 0.0), (0.0, 0.0))
    assert abs(follower.topics.vehicle_local_position.x) < 0.5
    assert -follower.topics.vehicle_local_position.z < 50.0
    follow(follower, 20.0, (50.0, 0.0), (0.0, 0.0))
    assert follower.topics.vehicle_local_position.x == pytest.approx(42.0, abs=0.5)


def test_a_target_that_stands_has_a_course_to_the_north_and_is_approached_from_there() -> None:
    """FlightTaskAutoFollowTarget begins north of it, and swings round to FLW_TGT_FA from a course of 0."""
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(1.0)
    follow(follower, 0.2, (0.0, 40.0), (0.0, 0.0))
    setpoint = follower.topics.trajectory_setpoint
    assert setpoint.position[:2] == pytest.approx((8.0, 40.0), abs=0.2)
    assert setpoint.yaw == pytest.approx(math.pi / 2.0, abs=0.05)
    follow(follower, 3.0, (0.0, 40.0), (0.0, 0.0))
    assert follower.topics.trajectory_setpoint.position[1] < 37.0  # by the west, as a PX4 v1.18 in drawn flights
    follow(follower, 27.0, (0.0, 40.0), (0.0, 0.0))
    local = follower.topics.vehicle_local_position
    assert (local.x, local.y) == pytest.approx((-8.0, 40.0), abs=0.5)
    assert follower.topics.trajectory_setpoint.yaw == pytest.approx(0.0, abs=0.05)


def test_the_place_turns_around_the_target_within_its_limits() -> None:
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET, FLW_TGT_MAX_VEL=3.0, FLW_TGT_FA=170.0)
    follow(follower, 0.2, (100.0, 0.0), (0.0, 0.0))
    rows = follower.fly(15.0)
    angles = [math.atan2(row.setpoint.position[1], row.setpoint.position[0] - 100.0) for row in rows]
    speeds = [math.hypot(*row.setpoint.velocity[:2]) for row in rows]
    steps = [8.0 * math.remainder(b - a, math.tau) / STEP_S for a, b in itertools.pairwise(angles)]
    assert max(speeds) == pytest.approx(3.0, abs=0.01) == max(steps)
    assert max(abs(b - a) for a, b in itertools.pairwise(speeds)) <= 2.0 * STEP_S + 1e-6
    assert math.degrees(angles[-1]) == pytest.approx(170.0, abs=0.5)
    fast = rows[speeds.index(max(speeds))].setpoint
    assert math.hypot(*fast.acceleration[:2]) == pytest.approx(3.0**2 / 8.0, abs=0.01)


def test_the_target_is_filtered_and_keeps_its_course_where_it_stops() -> None:
    """1 rad/s, damped by 0.7071; the filter's velocity swings back by more than 1 m/s, which turns nobody."""
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.fly(1.0)
    follow(follower, 20.0, (0.0, 0.0), (0.0, 12.0))
    follower.fly(0.2)
    wests = []
    for _ in range(30):
        follow(follower, 0.2, (0.0, 240.0), (0.0, 0.0))
        wests.append(-follower.topics.trajectory_setpoint.velocity[1])
    assert max(wests) > 1.0
    assert follower.topics.trajectory_setpoint.position[:2] == pytest.approx((0.0, 232.0), abs=1.0)


def test_a_filter_of_second_order_overshoots_as_its_damping_says() -> None:
    filtered = SecondOrderReferenceModel(1.0, 0.7071)
    filtered.reset((0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    places = []
    for _ in range(2000):
        filtered.update(0.01, (1.0, 0.0, 5.0), (0.0, 0.0, 0.0))
        places.append(filtered.state[0])
    assert max(places) == pytest.approx(1.0 + math.exp(-math.pi), abs=1e-3)
    assert places.index(max(places)) * 0.01 == pytest.approx(math.pi * math.sqrt(2.0), abs=0.1)
    assert filtered.state == pytest.approx((1.0, 0.0, 5.0), abs=1e-4)


def test_near_the_ground_it_climbs_where_it_is() -> None:
    follower = Follower(up=0.5, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follow(follower, 0.2, (50.0, 0.0), (0.0, 0.0))
    setpoint = follower.topics.trajectory_setpoint
    assert math.isnan(setpoint.position[0]) and -setpoint.position[2] == pytest.approx(0.5, abs=0.1)
    assert setpoint.velocity == (0.0, 0.0, -0.5)
    follower.fly(4.0)
    # As in PX4 the climb stays a feed-forward
    assert follower.topics.trajectory_setpoint.velocity[2] == -0.5


def test_it_takes_off_from_the_ground_once_there_is_a_target() -> None:
    follower = Follower(up=0.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.READY_FOR_TAKEOFF)
    follower.fly(1.0)
    assert not follower.topics.vehicle_constraints.want_takeoff
    follow(follower, 0.2, (50.0, 0.0), (0.0, 0.0))
    follower.fly(2.0)
    assert follower.topics.vehicle_constraints.want_takeoff


def test_a_target_that_was_told_before_the_mode_counts() -> None:
    """UORB gives TargetEstimator, which the task starts, the last follow_target; an old one stands."""
    follower = Follower(up=8.0)
    follow(follower, 0.2, (20.0, 0.0), (0.0, 5.0))
    follower.fly(30.0)
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=NavState.AUTO_FOLLOW_TARGET)
    rows = follower.fly(20.0)
    assert max(abs(row.setpoint.velocity[1]) for row in rows[:5]) < 0.1
    local = follower.topics.vehicle_local_position
    assert (local.x, local.y) == pytest.approx((12.0, 0.0), abs=0.1)


@pytest.mark.parametrize(
    ("stick", "seconds", "place"),
    [
        ({"throttle": 1.0}, 0.4, (-8.0, 0.0, 8.6)),
        ({"throttle": -1.0}, 60.0, (-8.0, 0.0, 1.0)),
        ({"pitch": 1.0}, 0.4, (-8.8, 0.0, 8.0)),
        ({"pitch": -1.0}, 60.0, (-1.0, 0.0, 8.0)),
        ({"roll": 1.0}, 3.0, (-8.0 * math.cos(1.5), -8.0 * math.sin(1.5), 8.0)),
    ],
)
def test_sticks_change_height_distance_and_angle(
    stick: dict[str, Any], seconds: float, place: tuple[float, float, float]
) -> None:
    """1.5 m/s, 2 m/s, and FLW_TGT_MAX_VEL around the target: 4 m/s at 8 m."""
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET, FLW_TGT_MAX_VEL=4.0)
    follow(follower, 30.0, (0.0, 0.0), (0.0, 0.0))
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, **stick)
    follow(follower, seconds, (0.0, 0.0), (0.0, 0.0))
    follower.topics.manual_control_setpoint = ManualControlSetpoint(3, True)
    follow(follower, 15.0, (0.0, 0.0), (0.0, 0.0))
    local = follower.topics.vehicle_local_position
    assert (local.x, local.y, -local.z) == pytest.approx(place, abs=0.1)
    follower.parameters.set("FLW_TGT_RS", 0.5)
    follow(follower, 2.0, (0.0, 0.0), (0.0, 0.0))
    local = follower.topics.vehicle_local_position
    assert (local.x, local.y, -local.z) == pytest.approx(place, abs=0.1)


def test_a_stick_waits_for_a_vehicle_that_lags_behind() -> None:
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET)
    follow(follower, 30.0, (0.0, 0.0), (0.0, 0.0))
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, throttle=1.0, pitch=1.0)
    for _ in range(300):
        follower.place(-8.0, 0.0, 8.0)
        follower.fly(STEP_S)
    north, _, down = follower.topics.trajectory_setpoint.position
    assert (north, -down) == pytest.approx((-9.0, 8.75), abs=0.05)


@pytest.mark.parametrize(("altitude_mode", "below_m"), [(0, 8.0), (1, 8.0), (2, 10.0)])
def test_the_gimbal_looks_down_to_the_target(altitude_mode: int, below_m: float) -> None:
    """To the height of home, to the ground or to the target's; the message is nobody's."""
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET, FLW_TGT_ALT_M=altitude_mode)
    lat, lon = HOME.reproject(0.0, 0.0)
    follower.topics.follow_target = FollowTarget(follower.now_us, lat, lon, ALTITUDE_M - 2.0, (0.0, 0.0, 0.0))
    follower.place(-8.0, 0.0, 8.0)
    follower.fly(0.02)
    told = follower.topics.gimbal_manager_set_attitude
    assert euler(told.q) == pytest.approx((0.0, -math.atan2(below_m, 8.0), 0.0), abs=0.01)
    assert (told.origin_sysid, told.origin_compid, told.flags) == (0, 0, 0)


def test_who_leaves_the_mode_gives_the_gimbal_back() -> None:
    """FlightTaskAutoFollowTarget's destructor: to the autopilot's own modules, on no link."""
    follower = Follower(up=8.0, nav_state=NavState.AUTO_FOLLOW_TARGET, MNT_MODE_IN=4)
    gimbal = Gimbal(follower.topics, follower.parameters, OutgoingCommands())
    take = VehicleCommand(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, 1, 1, -1, -1, 0, 0, 0, from_external=False)
    gimbal.handle_command(follower.now_us, take)
    follower.fly(0.1)
    gimbal.update(follower.now_us)
    assert gimbal._control == (1, 1)
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=NavState.AUTO_LOITER)
    follower.fly(0.1)
    gimbal.update(follower.now_us)
    assert gimbal._control == (0, 0)
    assert [record.command[1:5] for record in follower.topics.navigator_commands] == [(-3.0, -3.0, -1.0, -1.0)]


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
