"""Sticks, offboard and descend over a vehicle that follows perfectly."""

import itertools
import math
from collections.abc import Callable

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.modes.sticks import expo_deadzone
from sitl_emu.autopilot.topics import (
    GimbalDeviceAttitudeStatus,
    GimbalManagerStatus,
    OffboardSetpoint,
    TrajectorySetpoint,
    VehicleLocalPositionSetpoint,
    VelocityLimits,
)
from sitl_emu.core.attitude import quaternion
from tests.unit.modes_follower import STEP_S, Follower, move, stick_flight


def test_a_stick_has_a_dead_zone_a_curve_and_its_full_range() -> None:
    assert expo_deadzone(0.1, 0.1) == 0.0
    assert expo_deadzone(-1.0, 0.1) == pytest.approx(-1.0)
    assert expo_deadzone(-1.0, 1.0) == pytest.approx(-1.0), "never the whole way, whatever MAN_DEADZONE says"
    assert expo_deadzone(0.5, 0.1) == pytest.approx(0.2304, abs=1e-3)


def test_full_stick_flies_at_mpc_vel_manual_and_centred_it_stops_and_holds() -> None:
    follower = stick_flight()
    move(follower, pitch=1.0)
    row = follower.fly(12.0)[-1]
    assert row.local.vx == pytest.approx(10.0, abs=0.3) and math.isnan(row.setpoint.position[0])
    move(follower)
    row = follower.fly(6.0)[-1]
    assert math.hypot(row.local.vx, row.local.vy) < 0.1
    assert math.isfinite(row.setpoint.position[0]) and math.isfinite(row.setpoint.position[2])


def test_the_sticks_jerk_is_limited() -> None:
    follower = stick_flight()
    move(follower, pitch=1.0)
    accelerations = [row.setpoint.acceleration[0] for row in follower.fly(0.4)]
    steps = [b - a for a, b in itertools.pairwise(accelerations)]
    assert max(steps) <= 8.0 * STEP_S + 1e-6


def test_sticks_count_from_the_heading() -> None:
    follower = Follower(nav_state=NavState.POSCTL)
    follower.place(0.0, 0.0, 10.0, heading=math.pi / 2)
    move(follower, pitch=0.6)
    local = follower.fly(4.0)[-1].local
    assert local.vy > 1.0 and abs(local.vx) < 0.05


@pytest.mark.parametrize(("throttle", "down"), [(1.0, -3.0), (-1.0, 1.5)])
def test_the_throttle_stick_climbs_and_descends_by_its_own_limits(throttle: float, down: float) -> None:
    follower = stick_flight()
    move(follower, throttle=throttle)
    row = follower.fly(4.0)[-1]
    assert row.local.vz == pytest.approx(down, abs=0.05) and math.isnan(row.setpoint.position[2])
    move(follower)
    row = follower.fly(3.0)[-1]
    assert abs(row.local.vz) < 0.05 and math.isfinite(row.setpoint.position[2])


@pytest.mark.parametrize(("up", "throttle", "down"), [(2.0, 1.0, -1.5), (4.0, -1.0, 0.7), (7.5, -1.0, 1.1)])
def test_near_the_ground_sticks_climb_and_descend_slowly(up: float, throttle: float, down: float) -> None:
    """MPC_TKO_SPEED and MPC_LAND_SPEED below MPC_LAND_ALT2, the whole speed above MPC_LAND_ALT1."""
    follower = stick_flight(up=up)
    move(follower, throttle=throttle)
    fastest = max(abs(row.setpoint.velocity[2]) for row in follower.fly(1.0))
    assert fastest == pytest.approx(abs(down), abs=0.1)


@pytest.mark.parametrize(
    ("stick", "fastest"), [({"pitch": 1.0}, 10.0), ({"pitch": -1.0}, 4.0), ({"roll": 1.0}, 6.0), ({"roll": -1.0}, 6.0)]
)
def test_sideways_and_back_have_their_own_speeds(stick: dict[str, float], fastest: float) -> None:
    follower = stick_flight(MPC_VEL_MAN_BACK=4.0, MPC_VEL_MAN_SIDE=6.0)
    move(follower, **stick)
    local = follower.fly(15.0)[-1].local
    assert math.hypot(local.vx, local.vy) == pytest.approx(fastest, abs=0.3)


def test_a_turned_stick_changes_the_acceleration_along_a_straight_line() -> None:
    """The jerk's limit is that of both axes together."""
    follower = stick_flight()
    move(follower, pitch=1.0)
    follower.fly(2.0)
    before = follower.topics.trajectory_setpoint.acceleration
    move(follower, roll=1.0)
    first, last = follower.fly(2.0 * STEP_S)
    one = (last.setpoint.acceleration[0] - before[0], last.setpoint.acceleration[1] - before[1])
    assert math.hypot(*one) <= 2.0 * 8.0 * STEP_S + 1e-6 and one[0] < 0.0 < one[1]
    assert first.setpoint.velocity[0] > 1.0


def test_where_the_estimate_jumps_a_held_place_jumps_with_it() -> None:
    follower = stick_flight()
    held = follower.topics.trajectory_setpoint.position
    local = follower.topics.vehicle_local_position
    follower.topics.vehicle_local_position = local._replace(
        x=local.x + 2.0, xy_reset_counter=1, delta_xy=(2.0, 0.0), z=local.z - 1.0, z_reset_counter=1, delta_z=-1.0,
        heading=local.heading + 0.5, heading_reset_counter=1, delta_heading=0.5,
    )  # fmt: skip
    setpoint = follower.fly(STEP_S)[0].setpoint
    assert setpoint.position == pytest.approx((held[0] + 2.0, held[1], held[2] - 1.0), abs=0.01)
    assert setpoint.yaw == pytest.approx(0.5, abs=0.01)


def sees(follower: Follower, vxy_max: float, hagl_max_z: float, hagl_max_xy: float) -> Callable[[], None]:
    """An estimate that rests on what sees the ground no further than so."""

    def tell() -> None:
        local = follower.topics.vehicle_local_position
        follower.topics.vehicle_local_position = local._replace(
            dist_bottom=-local.z, dist_bottom_valid=True, vxy_max=vxy_max, hagl_max_z=hagl_max_z,
            hagl_max_xy=hagl_max_xy,
        )  # fmt: skip

    return tell


@pytest.mark.parametrize(("mode", "highest"), [(NavState.ALTCTL, 20.0), (NavState.POSCTL, 15.0)])
def test_sticks_climb_no_higher_than_the_estimate_sees(mode: NavState, highest: float) -> None:
    """FlightTaskManualAltitude::_respectMaxAltitude; in Position the lower limit of what sees sideways counts."""
    follower = stick_flight(mode, up=5.0)
    move(follower, throttle=1.0)
    rows = follower.fly(25.0, sees(follower, 20.0, 20.0, 15.0))
    assert -rows[-1].local.z == pytest.approx(highest, abs=0.3)
    assert max(-row.local.z for row in rows) < highest + 0.5
    assert follower.topics.vehicle_constraints.speed_up == pytest.approx(0.0, abs=0.3)
    follower.place(0.0, 0.0, highest + 4.0)
    last = follower.fly(8.0, sees(follower, 20.0, 20.0, 15.0))[-1].local
    assert -last.z == pytest.approx(highest, abs=0.5)


@pytest.mark.parametrize(("least", "held"), [(math.inf, 3.0), (5.0, 5.0)])
def test_over_ground_that_it_follows_no_height_is_held_that_is_too_low_for_its_sensors(
    least: float, held: float
) -> None:
    """FlightTaskManualAltitude::_respectMinAltitude: hagl_min of the estimate, infinite where anything goes."""
    follower = Follower(3.0, NavState.ALTCTL, MPC_ALT_MODE=1)

    def tell() -> None:
        local = follower.topics.vehicle_local_position
        follower.topics.vehicle_local_position = local._replace(
            dist_bottom=-local.z, dist_bottom_valid=True, hagl_min=least
        )

    move(follower)
    assert -follower.fly(1.0, tell)[-1].setpoint.position[2] == pytest.approx(held, abs=0.1)


@pytest.mark.parametrize(("measures_ground", "up"), [(False, 3.0), (True, 5.0)])
def test_a_higher_limit_of_the_climb_counts_from_the_next_mode_on_or_over_ground_that_is_measured(
    measures_ground: bool, up: float
) -> None:
    """FlightTaskManualAltitude sets its constraints as it is activated, and where dist_bottom is known."""
    follower = stick_flight(up=60.0)
    each = sees(follower, math.inf, math.inf, math.inf) if measures_ground else None
    move(follower, throttle=1.0)
    follower.parameters.set("MPC_Z_VEL_MAX_UP", 5.0)
    assert follower.fly(4.0, each)[-1].local.vz == pytest.approx(-up, abs=0.1)
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=NavState.ALTCTL)
    assert follower.fly(4.0, each)[-1].local.vz == pytest.approx(-5.0, abs=0.1)
    follower.parameters.set("MPC_Z_VEL_MAX_UP", 2.0)
    assert follower.fly(4.0, each)[-1].local.vz == pytest.approx(-2.0, abs=0.1)


def test_position_flies_no_faster_than_the_estimate_sees_and_slowly_near_its_greatest_height() -> None:
    """FlightTaskManualAcceleration::update: from 0.8 of that height on down to 2 m/s."""
    follower = stick_flight(up=10.0)
    move(follower, pitch=1.0)
    assert follower.fly(15.0, sees(follower, 6.0, 20.0, 20.0))[-1].local.vx == pytest.approx(6.0, abs=0.1)
    local = follower.topics.vehicle_local_position
    follower.topics.vehicle_local_position = local._replace(z=-18.0, z_reset_counter=1)
    assert follower.fly(15.0, sees(follower, 6.0, 20.0, 20.0))[-1].local.vx == pytest.approx(4.0, abs=0.1)
    assert follower.fly(25.0, sees(follower, math.inf, math.inf, math.inf))[-1].local.vx == pytest.approx(10.0, abs=0.2)


def test_position_slow_keeps_to_its_own_limits() -> None:
    follower = stick_flight(NavState.POSITION_SLOW)
    move(follower, pitch=1.0, throttle=1.0)
    local = follower.fly(12.0)[-1].local
    assert (local.vx, local.vz) == pytest.approx((3.0, -1.0), abs=0.1)
    move(follower, yaw=1.0)
    assert math.degrees(follower.fly(3.0)[-1].setpoint.yawspeed) == pytest.approx(45.0, abs=1.0)


@pytest.mark.parametrize(("knob", "fastest"), [(-1.0, 0.3), (0.0, 5.15), (1.0, 10.0)])
def test_a_knob_sets_the_speed_of_position_slow(knob: float, fastest: float) -> None:
    follower = stick_flight(NavState.POSITION_SLOW, MC_SLOW_MAP_HVEL=1)
    move(follower, pitch=1.0, aux1=knob)
    assert follower.fly(25.0)[-1].local.vx == pytest.approx(fastest, abs=0.1)


def test_limits_that_mavlink_tells_go_before_those_of_the_parameters() -> None:
    """But are no lower than MC_SLOW_MIN_*; the yaw rate that was not told keeps its default, 45 degrees/s."""
    follower = stick_flight(NavState.POSITION_SLOW)
    follower.topics.velocity_limits = VelocityLimits(1, 5.0, 0.1, math.nan)
    move(follower, pitch=1.0, throttle=1.0)
    local = follower.fly(15.0)[-1].local
    least = float(follower.parameters["MC_SLOW_MIN_VVEL"])
    assert (local.vx, local.vz) == pytest.approx((5.0, -least), abs=0.1)
    move(follower, yaw=1.0)
    assert math.degrees(follower.fly(3.0)[-1].setpoint.yawspeed) == pytest.approx(45.0, abs=1.0)


@pytest.mark.parametrize("system_id", [1, 2])
def test_position_slow_turns_a_gimbal_and_follows_it_and_gives_it_back(system_id: int) -> None:
    """FlightTaskManualAccelerationSlow::update: rates by MC_SLOW_DEF_YAWR, pitch by the knob of MC_SLOW_MAP_PTCH.

    It asks for control by a command for the component with the system's number (Utility/Gimbal.cpp).
    """
    follower = stick_flight(NavState.POSITION_SLOW, MC_SLOW_MAP_PTCH=1, MAV_SYS_ID=system_id)
    topics, all_locked = follower.topics, 0b11100
    move(follower, yaw=-0.5, aux1=0.4)
    assert follower.fly(0.1)[-1].setpoint.yawspeed < 0.0 and not topics.gimbal_manager_set_attitude.timestamp

    def tells(flags: int) -> None:
        topics.gimbal_device_attitude_status = GimbalDeviceAttitudeStatus(
            follower.now_us, flags, quaternion(0.0, -0.3, 1.2)
        )
        topics.gimbal_manager_status = GimbalManagerStatus(follower.now_us, flags, 154, 255, 190)

    setpoint = follower.fly(STEP_S, lambda: tells(0))[-1].setpoint
    told, rate = topics.gimbal_manager_set_attitude, math.radians(45.0)
    assert (told.origin_sysid, told.origin_compid, told.flags) == (system_id, 1, all_locked)
    assert told.angular_velocity[1:] == pytest.approx((0.4 * rate, -0.5 * rate))
    assert math.isnan(setpoint.yaw) and setpoint.yawspeed == pytest.approx(-0.5 * rate)
    (record,) = topics.navigator_commands
    assert record.command[1:5] == (system_id, 1.0, -1.0, -1.0) and record.command.target_component == system_id
    assert follower.fly(STEP_S, lambda: tells(all_locked))[-1].setpoint.yaw == pytest.approx(1.2)
    topics.vehicle_status = topics.vehicle_status._replace(nav_state=NavState.POSCTL)
    follower.fly(STEP_S)
    told = topics.gimbal_manager_set_attitude
    assert (told.flags, told.angular_velocity[1:]) == (0b01100, (0.0, 0.0))
    released = topics.navigator_commands[-1].command
    assert released[1:5] == (-3.0, -3.0, -1.0, -1.0) and released.target_component == 1


def test_in_altitude_cruise_the_tilt_stays() -> None:
    """A full stick takes the tilt from none to the greatest in half a second."""
    follower = stick_flight(NavState.ALTITUDE_CRUISE)
    move(follower, pitch=1.0)
    follower.fly(0.25)
    move(follower)
    setpoint = follower.fly(3.0)[-1].setpoint
    half = 0.5 * math.tan(math.radians(follower.parameters["MPC_MAN_TILT_MAX"])) * 9.80665
    assert setpoint.acceleration[0] == pytest.approx(half, abs=0.4) and abs(setpoint.acceleration[1]) < 1e-6


@pytest.mark.parametrize(("mode", "stick", "follows"), [(0, 0.0, False), (1, 0.0, True), (1, 0.3, True), (2, 0.0, True),
                                                        (2, 0.3, False)])  # fmt: skip
def test_a_held_height_is_that_over_the_ground_if_so_set(mode: int, stick: float, follows: bool) -> None:
    """MPC_ALT_MODE; the ground rises by 2 m beneath the vehicle."""
    follower = Follower(20.0, NavState.ALTCTL, MPC_ALT_MODE=mode)
    follower.topics.vehicle_local_position = follower.topics.vehicle_local_position._replace(
        dist_bottom_valid=True, dist_bottom=20.0
    )
    move(follower, pitch=stick)
    follower.fly(1.0)
    follower.topics.vehicle_local_position = follower.topics.vehicle_local_position._replace(dist_bottom=18.0)
    wanted = follower.fly(STEP_S)[0].setpoint.position[2]
    assert wanted == pytest.approx(-22.0 if follows else -20.0, abs=0.1)


@pytest.mark.parametrize("moving", [True, False])
def test_who_climbs_while_the_vehicle_moves_comes_back_to_the_height_where_it_stood(moving: bool) -> None:
    """As a real PX4 v1.18 (SIH) did by MPC_ALT_MODE 2, 2.1 m down; who climbs where it stands, stays up."""
    follower = Follower(20.0, NavState.POSCTL)

    def see() -> None:
        local = follower.topics.vehicle_local_position
        follower.topics.vehicle_local_position = local._replace(dist_bottom_valid=True, dist_bottom=-local.z)

    def fly(seconds: float, **sticks: float) -> float:
        move(follower, **sticks)
        return follower.fly(seconds, see)[-1].setpoint.position[2]

    assert fly(3.0) == pytest.approx(-20.0, abs=0.1)
    if moving:
        fly(1.5, pitch=1.0)
        fly(0.5, pitch=1.0, throttle=0.6)
    fly(4.0, throttle=0.6)
    up_m = -follower.topics.vehicle_local_position.z
    assert up_m > 22.0
    assert fly(5.0) == pytest.approx(-20.0 if moving else -up_m, abs=0.5)


def test_leaving_a_held_height_goes_on_with_the_controllers_velocity() -> None:
    follower = stick_flight()
    follower.topics.vehicle_local_position_setpoint = VehicleLocalPositionSetpoint(vz=-0.4)
    move(follower, throttle=1.0)
    assert follower.fly(STEP_S)[0].setpoint.velocity[2] == pytest.approx(-0.4, abs=0.05)


def test_the_yaw_stick_turns_and_centred_the_heading_is_held() -> None:
    follower = stick_flight()
    move(follower, yaw=0.5)
    row = follower.fly(3.0)[-1]
    assert math.degrees(row.setpoint.yawspeed) == pytest.approx(150.0 * 0.2304, abs=0.5)
    assert math.isnan(row.setpoint.yaw)
    move(follower)
    row = follower.fly(3.0)[-1]
    assert row.setpoint.yaw == pytest.approx(row.local.heading, abs=0.01)


@pytest.mark.parametrize("drift_deg_s", [0.5, 8.0])
@pytest.mark.parametrize("mode", [NavState.POSCTL, NavState.ALTCTL])
def test_a_held_heading_goes_along_while_the_estimator_turns_its_own(mode: NavState, drift_deg_s: float) -> None:
    """StickYaw::updateYawCorrection: told from the gyroscopes alone; what turns slowly, the vehicle follows."""
    follower = stick_flight(mode)
    start = follower.topics.vehicle_local_position

    def see(degrees: float) -> None:
        follower.topics.vehicle_local_position = follower.topics.vehicle_local_position._replace(
            heading=start.heading + math.radians(degrees), unaided_heading=start.heading
        )

    see(0.0)
    follower.fly(1.0, lambda: see(0.0))
    yaw = math.nan
    for step in range(500):
        see(min(step, 375) * STEP_S * drift_deg_s)
        yaw = follower.fly(STEP_S)[0].setpoint.yaw
    goes_along = drift_deg_s > 1.0
    assert math.degrees(yaw - start.heading) == pytest.approx(375 * STEP_S * drift_deg_s * goes_along, abs=1.2)


def test_without_sticks_position_mode_holds() -> None:
    follower = Follower(nav_state=NavState.POSCTL)
    local = follower.fly(4.0)[-1].local
    assert (local.x, local.y, local.z) == pytest.approx((0.0, 0.0, -10.0), abs=0.05)


def test_altitude_mode_tilts_by_the_stick_and_holds_the_height() -> None:
    follower = stick_flight(NavState.ALTCTL)
    move(follower, pitch=0.4)
    setpoint = follower.fly(2.0)[-1].setpoint
    assert math.degrees(math.atan(setpoint.acceleration[0] / 9.80665)) == pytest.approx(15.6, abs=0.1)
    assert math.isnan(setpoint.velocity[0]) and math.isfinite(setpoint.position[2])


def test_a_throttle_above_the_middle_asks_for_a_takeoff() -> None:
    follower = stick_flight()
    move(follower, throttle=0.5)
    follower.fly(0.1)
    assert follower.topics.vehicle_constraints.want_takeoff
    move(follower)
    follower.fly(0.1)
    assert not follower.topics.vehicle_constraints.want_takeoff


def test_offboard_passes_its_setpoint_on_unchanged() -> None:
    follower = Follower(nav_state=NavState.OFFBOARD)
    wanted = TrajectorySetpoint(follower.now_us, (1.0, 2.0, -12.0), yaw=0.3)
    follower.topics.offboard_setpoint = OffboardSetpoint(follower.now_us, wanted)
    setpoint = follower.fly(STEP_S)[0].setpoint
    assert setpoint.position == wanted.position and setpoint.yaw == wanted.yaw
    assert follower.topics.vehicle_constraints.want_takeoff


def test_offboard_without_a_trajectory_commands_nothing() -> None:
    follower = Follower(nav_state=NavState.OFFBOARD)
    setpoint = follower.fly(STEP_S)[0].setpoint
    assert all(math.isnan(value) for value in setpoint.position + setpoint.velocity)


def test_descend_goes_down_at_landing_speed_without_a_place() -> None:
    follower = Follower(nav_state=NavState.DESCEND)
    row = follower.fly(3.0)[-1]
    assert row.setpoint.velocity[2] == pytest.approx(0.7) and math.isnan(row.setpoint.position[0])


def test_descend_without_a_vertical_speed_sinks_all_the_same() -> None:
    follower = Follower(nav_state=NavState.DESCEND)
    follower.topics.vehicle_local_position = follower.topics.vehicle_local_position._replace(v_z_valid=False)
    setpoint = follower.fly(STEP_S)[0].setpoint
    assert math.isnan(setpoint.velocity[2]) and setpoint.acceleration == pytest.approx((0.0, 0.0, 0.3))


@pytest.mark.parametrize("mode", [NavState.STAB, NavState.ACRO, NavState.TERMINATION])
def test_modes_without_a_trajectory_publish_none(mode: NavState) -> None:
    follower = Follower()
    follower.go((50.0, 0.0, 10.0))
    follower.fly(1.0)
    follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=mode)
    follower.stand(STEP_S)
    assert all(math.isnan(value) for value in follower.topics.trajectory_setpoint.position)


def test_a_changed_parameter_counts_at_once_and_another_within_a_second() -> None:
    """FlightModeManager.hpp: its parameter_update has an interval of a second; a mode that begins knows all of them."""
    follower = stick_flight()
    limit = follower.topics.vehicle_constraints.speed_down
    move(follower, throttle=-1.0)

    def limited(seconds: float) -> float:
        follower.fly(seconds)
        return follower.topics.vehicle_constraints.speed_down

    topics = follower.topics
    topics.vehicle_local_position = topics.vehicle_local_position._replace(dist_bottom=30.0, dist_bottom_valid=True)
    follower.parameters.set("MPC_Z_VEL_MAX_DN", limit + 1.0)
    assert limited(STEP_S) == limit + 1.0
    follower.parameters.set("MPC_Z_VEL_MAX_DN", limit + 2.0)
    assert limited(STEP_S) == limit + 2.0, "after a pause two pass in a row"
    follower.parameters.set("MPC_Z_VEL_MAX_DN", limit + 3.0)
    assert limited(0.5) == limit + 2.0
    topics.vehicle_status = topics.vehicle_status._replace(nav_state=NavState.ALTCTL)
    assert limited(STEP_S) == limit + 3.0
    follower.parameters.set("MPC_Z_VEL_MAX_DN", limit + 4.0)
    assert limited(0.2) == limit + 3.0 and limited(0.5) == limit + 4.0


def test_a_changed_cruise_speed_counts_on_the_way() -> None:
    follower = Follower()
    follower.go((200.0, 0.0, 10.0))
    follower.fly(6.0)
    follower.parameters.set("MPC_XY_CRUISE", 2.0)
    local = follower.fly(5.0)[-1].local
    assert local.vx == pytest.approx(2.0, abs=0.1)
