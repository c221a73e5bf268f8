"""AUTO modes over a vehicle that follows perfectly: speeds, corners, heading, takeoff, landing, resets."""

import itertools
import math

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType, TakeoffState
from sitl_emu.autopilot.modes.land import descent_speed, land_speeds
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    ManualControlSetpoint,
    OffboardSetpoint,
    PositionSetpointTriplet,
    TakeoffStatus,
    TrajectorySetpoint,
    VehicleLandDetected,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from tests.unit.modes_follower import STEP_S, Follower, Row


def speed(row: Row) -> float:
    """Ground speed."""
    return math.hypot(row.local.vx, row.local.vy)


def test_it_cruises_at_mpc_xy_cruise_and_stops_at_the_target() -> None:
    follower = Follower()
    follower.go((50.0, 0.0, 10.0))
    rows = follower.fly(18.0)
    assert max(map(speed, rows)) == pytest.approx(5.0, abs=0.05)
    assert rows[-1].local.x == pytest.approx(50.0, abs=0.1)
    assert max(row.local.x for row in rows) < 50.1


@pytest.mark.parametrize(("wanted", "flown"), [(2.0, 2.0), (8.0, 8.0), (20.0, 12.0)])
def test_the_triplets_speed_counts_up_to_mpc_xy_vel_max(wanted: float, flown: float) -> None:
    follower = Follower()
    follower.go((150.0, 0.0, 10.0), speed=wanted)
    assert max(map(speed, follower.fly(15.0))) == pytest.approx(flown, abs=0.1)


def test_a_new_speed_counts_on_the_way() -> None:
    follower = Follower()
    follower.go((100.0, 0.0, 10.0))
    follower.fly(6.0)
    follower.go((100.0, 0.0, 10.0), speed=2.0)
    assert speed(follower.fly(5.0)[-1]) == pytest.approx(2.0, abs=0.05)


def test_acceleration_keeps_to_mpc_acc_hor_and_mpc_jerk_auto() -> None:
    follower = Follower(MPC_ACC_HOR=2.0, MPC_JERK_AUTO=3.0)
    follower.go((50.0, 0.0, 10.0))
    accelerations = [row.setpoint.acceleration[0] for row in follower.fly(8.0)]
    assert max(accelerations) == pytest.approx(2.0, abs=0.01)
    steps = [b - a for a, b in itertools.pairwise(accelerations)]
    assert max(steps) <= 3.0 * STEP_S + 1e-6


def test_height_and_place_are_approached_independently() -> None:
    follower = Follower(up=25.0)
    follower.go((10.0, 0.0, 10.0))
    rows = follower.fly(8.0)
    assert max(map(speed, rows)) > 2.7
    assert max(row.local.vz for row in rows) == pytest.approx(1.5, abs=0.02)


def test_a_climb_keeps_to_mpc_z_v_auto_up() -> None:
    follower = Follower()
    follower.go((0.0, 0.0, 40.0))
    assert min(row.local.vz for row in follower.fly(8.0)) == pytest.approx(-3.0, abs=0.02)


def test_a_corner_is_cut_without_a_stop() -> None:
    follower = Follower(up=8.0)
    corners = [(0.0, 0.0, 8.0), (40.0, 0.0, 8.0), (40.0, 40.0, 8.0)]
    follower.go(*corners)

    def switch() -> None:
        if follower.topics.vehicle_local_position.x > 30.2:
            raise StopIteration

    before = follower.fly(20.0, switch)
    follower.go(corners[1], corners[2])
    after = follower.fly(6.0)
    nearest = min(math.hypot(row.local.x - 40.0, row.local.y) for row in before + after)
    assert 2.0 < nearest < 6.0
    assert min(map(speed, after[:400])) > 2.0


def test_a_waypoint_with_none_after_it_is_stopped_at() -> None:
    follower = Follower(up=8.0)
    follower.go((0.0, 0.0, 8.0), (20.0, 0.0, 8.0))
    rows = follower.fly(12.0)
    assert rows[-1].local.x == pytest.approx(20.0, abs=0.1) and speed(rows[-1]) < 0.05


def test_a_vehicle_beside_its_leg_flies_back_to_it_first() -> None:
    """By PositionSmoothing alone: while it turns, it aims at the leg a little ahead."""
    follower = Follower()
    follower.place(0.0, 30.0, 10.0)
    follower.go((0.0, 0.0, 10.0), (100.0, 0.0, 10.0), acceptance_m=2.0)
    rows = follower.fly(25.0)
    assert abs(rows[-1].local.y) < 2.5
    assert follower.topics.vehicle_local_position.x > 20.0


def test_it_looks_where_it_flies_and_keeps_that_heading_when_it_arrives() -> None:
    follower = Follower()
    follower.go((0.0, 60.0, 10.0), acceptance_m=5.0)
    rows = follower.fly(22.0)
    assert math.degrees(rows[-1].local.heading) == pytest.approx(90.0, abs=2.0)
    assert max(row.setpoint.yawspeed for row in rows) <= math.radians(60.0) + 1e-6


def test_the_triplets_yaw_goes_before_that_of_the_way() -> None:
    follower = Follower()
    follower.go((0.0, 60.0, 10.0), yaw=math.radians(-45.0))
    assert math.degrees(follower.fly(8.0)[-1].local.heading) == pytest.approx(-45.0, abs=0.5)


def test_a_heading_that_is_not_good_is_kept() -> None:
    """FlightTaskAuto: no yaw, and a rate of 0, until vehicle_local_position.heading_good_for_control."""
    follower = Follower()
    follower.go((0.0, 60.0, 10.0), yaw=math.radians(-45.0))
    follower.tell_heading(is_good=False)
    rows = follower.fly(4.0)
    assert all(math.isnan(row.setpoint.yaw) and row.setpoint.yawspeed == 0.0 for row in rows)
    assert speed(rows[-1]) > 4.0
    follower.tell_heading(is_good=True)
    assert math.degrees(follower.fly(8.0)[-1].local.heading) == pytest.approx(-45.0, abs=0.5)


@pytest.mark.parametrize("mode", [1, 2, 5])
def test_mpc_yaw_mode_by_home_or_fixed(mode: int) -> None:
    """Without a home to look at, and with a fixed heading, it keeps the one that it had."""
    follower = Follower(MPC_YAW_MODE=mode)
    follower.go((0.0, 60.0, 10.0))
    assert math.degrees(follower.fly(8.0)[-1].local.heading) == pytest.approx(0.0, abs=0.5)


def test_mpc_yaw_mode_3_looks_along_the_trajectory_and_keeps_that_near_its_end() -> None:
    follower = Follower(MPC_YAW_MODE=3)
    follower.go((-30.0, 30.0, 10.0), acceptance_m=5.0)
    assert math.degrees(follower.fly(14.0)[-1].local.heading) == pytest.approx(135.0, abs=2.0)


@pytest.mark.parametrize("held", [0.4, math.nan])
def test_mpc_yaw_mode_3_holds_the_heading_of_the_last_mode_before_it_moves(held: float) -> None:
    """FlightTaskAuto::activate takes the last setpoint's for the previous one; after sticks to thrust there is none."""
    follower = Follower(nav_state=NavState.STAB, MPC_YAW_MODE=3)
    follower.fly(0.1)
    follower.topics.trajectory_setpoint = TrajectorySetpoint(follower.now_us, yaw=held)
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=NavState.AUTO_LOITER)
    follower.go((0.0, 0.0, 10.0), kind=SetpointType.LOITER)
    yaw = follower.fly(0.1)[-1].setpoint.yaw
    assert yaw == pytest.approx(held, nan_ok=True)
    follower.go((0.0, 60.0, 10.0), kind=SetpointType.LOITER)
    assert math.degrees(follower.fly(6.0)[-1].local.heading) == pytest.approx(90.0, abs=3.0)


def test_mpc_yaw_mode_4_turns_before_it_flies() -> None:
    follower = Follower(MPC_YAW_MODE=4)
    follower.go((0.0, 60.0, 10.0))
    rows = follower.fly(10.0)
    turned = next(row.t for row in rows if abs(math.degrees(row.local.heading) - 90.0) < 12.0)
    assert all(speed(row) < 0.1 for row in rows if row.t < turned)
    assert speed(rows[-1]) > 4.0


@pytest.mark.parametrize("mode", [0, 3, 4, 5])
def test_whatever_mpc_yaw_mode_it_wants_to_take_off(mode: int) -> None:
    """FlightTaskAuto::activate leaves _yaw_sp_aligned as it is, and on the ground it is called in every step."""
    follower = Follower(up=0.0, nav_state=NavState.AUTO_TAKEOFF, MPC_YAW_MODE=mode)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.READY_FOR_TAKEOFF)
    follower.go((0.0, 0.0, 10.0), kind=SetpointType.TAKEOFF)
    follower.stand(3.0 * STEP_S)
    assert follower.topics.vehicle_constraints.want_takeoff


def test_a_takeoff_rises_where_it_left_the_ground() -> None:
    """Wherever its waypoint lies; and its trajectory begins where the vehicle has drifted to before it flies."""
    follower = Follower(up=0.0, nav_state=NavState.AUTO_TAKEOFF)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.RAMPUP)
    follower.go((6.0, 0.0, 10.0), kind=SetpointType.TAKEOFF)
    follower.fly(0.5)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.FLIGHT)
    rows = follower.fly(12.0)
    assert max(abs(row.local.x) for row in rows) < 0.1
    assert -rows[-1].local.z == pytest.approx(10.0, abs=0.1)


def test_a_takeoff_climbs_at_mpc_tko_speed_near_the_ground() -> None:
    follower = Follower(up=0.0, nav_state=NavState.AUTO_TAKEOFF)
    follower.go((0.0, 0.0, 30.0), kind=SetpointType.TAKEOFF, yaw=0.0)
    rows = follower.fly(14.0)
    low = [-row.local.vz for row in rows if -row.local.z < 8.0]
    assert max(low) == pytest.approx(1.5, abs=0.1)
    assert max(-row.local.vz for row in rows) > 2.5
    assert follower.topics.vehicle_constraints.want_takeoff


def test_on_the_ground_it_begins_anew_until_the_ramp_begins() -> None:
    follower = Follower(up=0.0, nav_state=NavState.AUTO_TAKEOFF)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.SPOOLUP)
    follower.topics.vehicle_land_detected = VehicleLandDetected(landed=True)
    follower.go((0.0, 0.0, 30.0), kind=SetpointType.TAKEOFF)
    assert follower.stand(4.0).velocity[2] == pytest.approx(0.7, abs=0.01)
    assert follower.topics.vehicle_constraints.want_takeoff
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.RAMPUP)
    # Then MPC_TKO_SPEED over MPC_TKO_RAMP_T, 0.5 m/s², lifts it, landed or not.
    assert follower.stand(2.4).velocity[2] == pytest.approx(0.7 - 0.5 * 2.4, abs=0.05)


def test_a_landing_slows_down_by_height_and_crawls_by_the_range_sensor() -> None:
    follower = Follower(up=15.0, nav_state=NavState.AUTO_LAND)
    follower.go((0.0, 0.0, 0.0), kind=SetpointType.LAND)
    rows = follower.fly(16.0)

    def at(up: float) -> float:
        return next(row.local.vz for row in rows if -row.local.z < up)

    assert at(12.0) == pytest.approx(1.5, abs=0.02)
    assert at(7.0) == pytest.approx(0.7 + 0.8 * 2.0 / 5.0, abs=0.06)
    assert at(2.0) == pytest.approx(0.7, abs=0.02)
    local = follower.topics.vehicle_local_position
    follower.topics.vehicle_local_position = local._replace(dist_bottom=0.9, dist_bottom_valid=True)
    assert follower.fly(2.0)[-1].local.vz == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("alt1", [2.0, 6.0])
def test_an_upper_height_of_landing_that_is_no_upper_one_counts_as_the_lower_one(alt1: float) -> None:
    """FlightTaskAuto::updateParams: all of the descent speed, and the landing speed from MPC_LAND_ALT2."""
    speeds = land_speeds(Parameters(VehicleKind.MULTICOPTER, {"MPC_LAND_ALT1": alt1, "MPC_LAND_ALT2": 6.0}))
    assert descent_speed(speeds, 6.01, math.nan) == speeds.fast
    assert descent_speed(speeds, 6.0, math.nan) == speeds.slow
    assert descent_speed(speeds, math.nan, math.nan) == speeds.slow
    assert descent_speed(speeds, 6.01, 0.5) == speeds.crawl


def test_a_landing_keeps_its_place_and_heading() -> None:
    follower = Follower(up=15.0, nav_state=NavState.AUTO_LAND)
    follower.place(3.0, 4.0, 15.0, heading=1.0)
    follower.go((3.0, 4.0, 0.0), kind=SetpointType.LAND)
    local = follower.fly(10.0)[-1].local
    assert (local.x, local.y, local.heading) == pytest.approx((3.0, 4.0, 1.0), abs=0.05)


def test_idle_leaves_no_thrust() -> None:
    follower = Follower()
    follower.go((0.0, 0.0, 10.0), kind=SetpointType.IDLE)
    setpoint = follower.fly(0.1)[-1].setpoint
    assert setpoint.acceleration[2] > 50.0 and math.isnan(setpoint.position[2])


def test_without_a_triplet_it_stays_near() -> None:
    follower = Follower()
    follower.topics.position_setpoint_triplet = PositionSetpointTriplet()
    local = follower.fly(5.0)[-1].local
    assert (local.x, local.y, local.z) == pytest.approx((0.0, 0.0, -10.0), abs=0.1)


def test_a_mission_goes_over_into_its_pause_without_a_step() -> None:
    follower = Follower(nav_state=NavState.AUTO_MISSION)
    follower.go((100.0, 0.0, 10.0))
    last = follower.fly(6.0)[-1].setpoint
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=NavState.AUTO_LOITER)
    follower.go((30.0, 0.0, 10.0), kind=SetpointType.LOITER)
    first = follower.fly(STEP_S)[0].setpoint
    assert first.velocity[0] == pytest.approx(last.velocity[0], abs=0.05)


def test_an_auto_mode_begins_with_the_setpoint_that_the_last_mode_flew() -> None:
    follower = Follower(nav_state=NavState.POSCTL)
    follower.place(0.0, 0.0, 10.0, heading=0.5)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(valid=True, pitch=1.0)
    last = follower.fly(3.0)[-1].setpoint
    follower.place(0.0, 0.0, 10.0)
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=NavState.AUTO_LOITER)
    follower.go((20.0, 0.0, 10.0), kind=SetpointType.LOITER)
    first = follower.fly(STEP_S)[0].setpoint
    assert last.velocity[0] > 3.0 and first.velocity[:2] == pytest.approx(last.velocity[:2], abs=0.1)
    assert first.yaw == pytest.approx(0.5, abs=0.01)


def test_an_auto_mode_after_offboard_begins_where_the_vehicle_is() -> None:
    follower = Follower(nav_state=NavState.OFFBOARD)
    follower.topics.offboard_setpoint = follower.topics.offboard_setpoint._replace(
        trajectory=TrajectorySetpoint(follower.now_us, position=(90.0, 0.0, -40.0), yaw=1.5)
    )
    follower.fly(0.5)
    local = follower.topics.vehicle_local_position
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=NavState.AUTO_LOITER)
    follower.go((local.x, local.y, -local.z), kind=SetpointType.LOITER)
    first = follower.fly(STEP_S)[0].setpoint
    assert first.position == pytest.approx((local.x, local.y, local.z), abs=0.3)
    assert first.yaw == pytest.approx(local.heading, abs=0.01)


def test_offboard_goes_on_with_what_was_flown_until_a_setpoint_comes_in_the_mode() -> None:
    """MAVLink passes setpoints on in OFFBOARD alone (handle_message_set_position_target_local_ned)."""
    follower = Follower()
    follower.go((50.0, 0.0, 10.0))
    last = follower.fly(4.0)[-1].setpoint
    topics, wanted = follower.topics, TrajectorySetpoint(follower.now_us, (0.0, 40.0, -20.0))
    topics.offboard_setpoint = topics.offboard_setpoint._replace(timestamp=follower.now_us, trajectory=wanted)
    topics.vehicle_status = topics.vehicle_status._replace(
        nav_state=NavState.OFFBOARD, nav_state_timestamp=follower.now_us + 1
    )
    assert follower.fly(0.1)[-1].setpoint == last
    wishes = [topics.vehicle_constraints.want_takeoff]
    told = wanted._replace(timestamp=follower.now_us)
    topics.offboard_setpoint = topics.offboard_setpoint._replace(timestamp=follower.now_us, trajectory=told)
    for _ in range(2):
        assert follower.fly(STEP_S)[0].setpoint == told
        wishes.append(topics.vehicle_constraints.want_takeoff)
    assert wishes == [False, True, False], "while it is new"


def test_a_reset_of_the_estimate_moves_the_trajectory_along() -> None:
    follower = Follower()
    follower.go((50.0, 0.0, 10.0))
    follower.fly(6.0)
    local = follower.topics.vehicle_local_position
    follower.topics.vehicle_local_position = local._replace(x=local.x + 8.0, xy_reset_counter=1)
    setpoint = follower.fly(STEP_S)[0].setpoint
    assert setpoint.position[0] == pytest.approx(local.x + 8.0, abs=0.2)


def test_on_the_ground_the_trajectory_does_not_shake_with_the_vehicle() -> None:
    """FlightTaskAuto::reActivate, after each step: no acceleration, 0.7 m/s down."""
    follower = Follower(up=0.0)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.READY_FOR_TAKEOFF)
    follower.topics.vehicle_local_position = follower.topics.vehicle_local_position._replace(ax=0.4, ay=-0.3, az=0.5)
    assert follower.stand(STEP_S).acceleration == pytest.approx((0.4, -0.3, 0.5)), "it has begun where the vehicle was"
    setpoint = follower.stand(2.0 * STEP_S)
    a_step = follower.parameters["MPC_JERK_AUTO"] * STEP_S
    assert setpoint.acceleration == pytest.approx((0.0, 0.0, 0.0), abs=a_step + 1e-6), "a step of the plan of before"
    assert setpoint.velocity == pytest.approx((0.0, 0.0, 0.7), abs=1e-3)


def test_on_the_ground_the_trajectory_still_has_the_plan_of_before() -> None:
    """VelocitySmoothing::reset takes the state alone: each step tells of the jerk that ends the 0.7 m/s."""
    follower = Follower(up=0.0, MPC_JERK_AUTO=4.0)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.READY_FOR_TAKEOFF)
    setpoint = follower.fly(0.08)[-1].setpoint
    assert setpoint.jerk == (0.0, 0.0, -4.0) and setpoint.acceleration[2] == pytest.approx(-4.0 * STEP_S)
    assert setpoint.velocity[2] == pytest.approx(0.7, abs=1e-3)


def test_what_brakes_from_a_dive_is_not_cut_off_by_the_limits() -> None:
    """FlightTaskAuto::_updateTrajConstraints: the controller may go as fast as the trajectory still does."""
    follower = Follower(up=100.0)
    follower.topics.vehicle_local_position = follower.topics.vehicle_local_position._replace(vz=6.0)
    follower.go((0.0, 0.0, 90.0), kind=SetpointType.LOITER)
    follower.fly(0.024)
    assert follower.topics.vehicle_constraints.speed_down == pytest.approx(6.0, abs=0.1)
    follower.fly(8.0)
    assert follower.topics.vehicle_constraints.speed_down == pytest.approx(1.8)


def test_much_too_fast_it_brakes_before_it_goes_on() -> None:
    follower = Follower()
    follower.topics.vehicle_local_position = follower.topics.vehicle_local_position._replace(vx=18.0)
    follower.go((-50.0, 0.0, 10.0))
    rows = follower.fly(4.0)
    assert min(row.setpoint.acceleration[0] for row in rows) < -5.0


@pytest.mark.parametrize(("nav_state", "apart_ms"), [(NavState.AUTO_LOITER, {16, 24}), (NavState.OFFBOARD, {8})])
def test_a_task_runs_with_every_second_or_third_estimate_and_offboard_with_each(
    nav_state: NavState, apart_ms: set[int]
) -> None:
    """50 Hz of 125: FlightModeManager::init, and uORB's SubscriptionInterval, which keeps to 20 ms on average."""
    follower = Follower(nav_state=nav_state)
    follower.go((50.0, 0.0, 10.0), kind=SetpointType.LOITER)
    ran_us = []
    for _ in range(250):
        follower.now_us += 8_000
        topics, now_us = follower.topics, follower.now_us
        topics.vehicle_local_position = topics.vehicle_local_position._replace(timestamp=now_us)
        topics.offboard_setpoint = OffboardSetpoint(now_us, TrajectorySetpoint(now_us, position=(9.0, 0.0, -10.0)))
        before = topics.trajectory_setpoint
        follower.modes.update(now_us)
        if topics.trajectory_setpoint is not before:
            ran_us.append(now_us)
    intervals_ms = [(b - a) // 1000 for a, b in itertools.pairwise(ran_us)][2:]
    assert set(intervals_ms) == apart_ms
    if nav_state is not NavState.OFFBOARD:
        assert sum(intervals_ms) / len(intervals_ms) == pytest.approx(20.0, abs=0.1)
