"""Sticks that are velocities at once (MPC_POS_MODE 0), over a vehicle that follows perfectly."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.modes.sticks import expo_deadzone
from sitl_emu.autopilot.topics import TrajectorySetpoint
from tests.unit.modes_follower import STEP_S, Follower, stick_flight
from tests.unit.modes_follower import move as deflect


def direct(mode: NavState = NavState.POSCTL, up: float = 30.0, **changes: float) -> Follower:
    """A vehicle high up with its sticks centred for a second; `changes` of parameters."""
    return stick_flight(mode, up, MPC_POS_MODE=0, **changes)


def move(follower: Follower, seconds: float = STEP_S, **sticks: float) -> TrajectorySetpoint:
    """Deflect the sticks for a time; the last setpoint."""
    deflect(follower, **sticks)
    return follower.fly(seconds)[-1].setpoint


def test_a_stick_is_a_velocity_at_once_and_no_acceleration() -> None:
    """FlightTaskManualPosition::_scaleSticks; 10 m/s is MPC_VEL_MANUAL."""
    follower = direct()
    setpoint = move(follower, pitch=0.6, roll=0.6)
    assert setpoint.velocity[:2] == pytest.approx([10.0 * expo_deadzone(0.6, 0.1)] * 2)
    assert all(map(math.isnan, setpoint.acceleration + setpoint.position[:2]))
    assert move(follower, pitch=1.0, roll=1.0).velocity[:2] == pytest.approx([10.0 * math.sqrt(0.5)] * 2)


@pytest.mark.parametrize(
    ("stick", "fastest"), [({"pitch": -1.0}, -4.0), ({"pitch": 1.0}, 10.0), ({"roll": -1.0}, -6.0)]
)
def test_sideways_and_back_have_their_own_speeds(stick: dict[str, float], fastest: float) -> None:
    velocity = move(direct(MPC_VEL_MAN_BACK=4.0, MPC_VEL_MAN_SIDE=6.0), **stick).velocity
    assert velocity[0] + velocity[1] == pytest.approx(fastest)


def test_it_counts_from_the_heading_that_is_held() -> None:
    follower = direct()
    follower.place(0.0, 0.0, 30.0, heading=math.pi / 2)
    move(follower, 0.5, yaw=0.5)
    move(follower, 3.0)
    heading = follower.topics.trajectory_setpoint.yaw
    velocity = move(follower, pitch=1.0).velocity
    assert math.atan2(velocity[1], velocity[0]) == pytest.approx(heading)


def test_the_place_is_held_once_it_is_slow_enough() -> None:
    """MPC_HOLD_MAX_XY (_updateXYlock)."""
    follower = direct()
    move(follower, 5.0, pitch=1.0)
    setpoint = move(follower)
    assert setpoint.velocity[:2] == (0.0, 0.0) and math.isnan(setpoint.position[0])
    rows = follower.fly(5.0)
    held = next(row for row in rows if math.isfinite(row.setpoint.position[0]))
    assert held.local.vx == pytest.approx(follower.parameters["MPC_HOLD_MAX_XY"], abs=0.1)
    assert rows[-1].setpoint.position[:2] == held.setpoint.position[:2]


@pytest.mark.parametrize("mode", [NavState.POSCTL, NavState.ALTCTL])
def test_throttle_is_a_velocity_at_once_and_the_height_is_held_once_it_is_slow_enough(mode: NavState) -> None:
    """MPC_HOLD_MAX_Z (FlightTaskManualAltitude::_updateAltitudeLock)."""
    follower = direct(mode)
    held = follower.topics.trajectory_setpoint
    assert held.position[2] == pytest.approx(-30.0, abs=0.01) and held.velocity[2] == 0.0
    setpoint = move(follower, throttle=1.0)
    assert setpoint.velocity[2] == -3.0 and math.isnan(setpoint.position[2]) and math.isnan(setpoint.acceleration[2])
    move(follower, 3.0, throttle=1.0)
    assert math.isnan(move(follower).position[2])
    rows = follower.fly(3.0)
    slow = next(row for row in rows if math.isfinite(row.setpoint.position[2]))
    assert slow.local.vz == pytest.approx(-follower.parameters["MPC_HOLD_MAX_Z"], abs=0.1)


def test_it_follows_the_ground_as_mpc_alt_mode_has_it() -> None:
    follower = direct(NavState.ALTCTL, MPC_ALT_MODE=1)
    local = follower.topics.vehicle_local_position
    follower.topics.vehicle_local_position = local._replace(dist_bottom=12.0, dist_bottom_valid=True)
    follower.fly(0.1)
    before = follower.topics.trajectory_setpoint.position[2]
    local = follower.topics.vehicle_local_position
    follower.topics.vehicle_local_position = local._replace(dist_bottom=10.0)
    assert follower.fly(STEP_S)[0].setpoint.position[2] == pytest.approx(before - 2.0, abs=0.05)


def test_where_the_estimate_jumps_what_is_held_jumps_with_it() -> None:
    follower = direct()
    local = follower.topics.vehicle_local_position
    follower.topics.vehicle_local_position = local._replace(
        x=local.x + 2.0, xy_reset_counter=1, z=local.z - 1.0, z_reset_counter=1
    )
    setpoint = follower.fly(STEP_S)[0].setpoint
    assert setpoint.position == pytest.approx((local.x + 2.0, local.y, local.z - 1.0), abs=0.01)


def test_mpc_pos_mode_counts_in_flight() -> None:
    follower = direct()
    assert math.isnan(move(follower, 1.0, pitch=1.0).acceleration[0])
    follower.parameters.set("MPC_POS_MODE", 4)
    assert math.isfinite(follower.fly(STEP_S)[0].setpoint.acceleration[0])
    follower.parameters.set("MPC_POS_MODE", 3)
    follower.fly(STEP_S)
    assert follower.parameters["MPC_POS_MODE"] == 4
    assert follower.texts.lines[-1].line == "[flight_mode_manager] MPC_POS_MODE 3 invalid, resetting"
