"""Modes that sticks fly, where there are none, and on the ground, where their task begins anew at every update."""

import math

import pytest

from sitl_emu.autopilot.constants import GEAR_DOWN, NavState, TakeoffState
from sitl_emu.autopilot.topics import ManualControlSetpoint, TakeoffStatus
from tests.typed import now
from tests.unit.modes_follower import STEP_S, Follower, move, stick_flight

LAND_SPEED = 0.7
JERK = 8.0
"""MPC_LAND_SPEED and MPC_JERK_MAX."""


def stands(mode: NavState, **changes: float) -> Follower:
    """On the ground, its rotors' ramp not begun."""
    follower = Follower(0.0, mode, **changes)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.READY_FOR_TAKEOFF)
    return follower


def lose(follower: Follower) -> None:
    follower.topics.manual_control_setpoint = ManualControlSetpoint(follower.now_us)


@pytest.mark.parametrize("mode", [NavState.POSCTL, NavState.ALTCTL, NavState.POSITION_SLOW])
def test_a_low_throttle_on_the_ground_asks_to_sink_after_a_while(mode: NavState) -> None:
    """Half a jerk's step at each update: the plan of the update before outlives the new beginning."""
    follower = stands(mode)
    move(follower, throttle=-1.0)
    after_s = 3.0
    gained = after_s / STEP_S * 0.5 * JERK * STEP_S * STEP_S
    assert follower.stand(after_s).velocity[2] == pytest.approx(gained, abs=0.01)
    assert follower.stand(10.0).velocity[2] == pytest.approx(LAND_SPEED, abs=0.01)


def test_no_faster_than_it_was_allowed_to_be_before_it_lifted_off() -> None:
    """What a task has slewed it keeps on the ground: MC_SLOW_* counts from the first metre on."""
    follower = stands(NavState.POSITION_SLOW, MC_SLOW_DEF_HVEL=3.0, MPC_ACC_HOR=3.0)
    move(follower, pitch=1.0)
    follower.stand(5.0)
    follower.topics.takeoff_status = TakeoffStatus(state=TakeoffState.FLIGHT)
    fastest = max(math.hypot(*row.setpoint.velocity[:2]) for row in follower.fly(6.0))
    assert fastest == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize("mode", [NavState.POSCTL, NavState.ALTCTL, NavState.POSITION_SLOW])
@pytest.mark.parametrize("position_mode", [0, 4])
def test_without_sticks_descend_runs_until_there_are_some(mode: NavState, position_mode: int) -> None:
    follower = stands(mode, MPC_POS_MODE=position_mode)
    lose(follower)
    setpoint = follower.stand(1.0)
    assert setpoint.velocity[2] == pytest.approx(LAND_SPEED) and math.isnan(setpoint.position[2])
    assert follower.topics.landing_gear.landing_gear == GEAR_DOWN
    said = [one.line for one in follower.texts.lines]
    unable = "[flight_mode_manager] Matching flight task was not able to run, Nav state:"
    assert said == [f"{unable} {mode:d}, Task: 1"], "once"
    move(follower, throttle=0.0)
    assert follower.stand(STEP_S * 2).velocity[2] != pytest.approx(LAND_SPEED)


@pytest.mark.parametrize("mode", [NavState.ORBIT, NavState.ALTITUDE_CRUISE])
def test_some_need_no_sticks(mode: NavState) -> None:
    follower = Follower(30.0, mode)
    lose(follower)
    assert abs(follower.fly(1.0)[-1].setpoint.velocity[2]) < 0.1


def test_sticks_that_are_lost_in_flight_leave_no_setpoint() -> None:
    follower = stick_flight()
    move(follower, pitch=1.0)
    follower.fly(2.0)
    lose(follower)
    setpoint, constraints = follower.stand(STEP_S), follower.topics.vehicle_constraints
    everything = (*setpoint.position, *setpoint.velocity, *setpoint.acceleration, setpoint.yaw, setpoint.yawspeed)
    assert all(map(math.isnan, (*everything, constraints.speed_up, constraints.speed_down)))
    move(follower)
    follower.stand(STEP_S)
    assert math.isfinite(now(follower.topics).trajectory_setpoint.velocity[0]), "it runs on"
