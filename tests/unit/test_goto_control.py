"""A trajectory to a place: within its limits, there, and no further when it is asked for no more."""

import math

import pytest

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.modes.goto_control import GotoControl
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import GotoSetpoint, TrajectorySetpoint, VehicleLocalPosition
from sitl_emu.vehicles import load

DT_S = 0.02


@pytest.fixture
def parameters() -> Parameters:
    return Autopilot(load("iris").airframe, 0).parameters


class Follower:
    """A vehicle that is where the trajectory is."""

    def __init__(self, parameters: Parameters) -> None:
        self.control, self.now_us = GotoControl(parameters), 1_000_000
        self.here = VehicleLocalPosition(
            x=0.0, y=0.0, z=-5.0, vx=0.0, vy=0.0, vz=0.0, ax=0.0, ay=0.0, az=0.0, heading=0.0
        )
        self.told: list[TrajectorySetpoint] = []

    def go(self, seconds: float, position: tuple[float, float, float], fresh: bool = True, **limits: float) -> None:
        """Ask for a place for so long."""
        asked_us = self.now_us
        for _ in range(round(seconds / DT_S)):
            self.now_us += round(DT_S * 1e6)
            goto = GotoSetpoint(self.now_us if fresh else asked_us, position, **limits)
            setpoint = self.control.update(self.now_us, DT_S, goto, self.here)
            self.told.append(setpoint)
            if math.isfinite(setpoint.position[0]):
                x, y, z = setpoint.position
                self.here = self.here._replace(x=x, y=y, z=z)

    def fastest(self) -> tuple[float, float, float]:
        """Of all: horizontally, up, down."""
        speeds = [each.velocity for each in self.told]
        ups = [-speed[2] for speed in speeds]
        return max(math.hypot(*speed[:2]) for speed in speeds), max(ups), -min(ups)


def test_its_limits_are_the_vehicle_s_where_none_are_given(parameters: Parameters) -> None:
    follower = Follower(parameters)
    follower.go(40.0, (80.0, 60.0, -40.0))
    assert math.dist((follower.here.x, follower.here.y), (80.0, 60.0)) < 0.01
    horizontal, up, _ = follower.fastest()
    assert horizontal == pytest.approx(parameters["MPC_XY_CRUISE"], rel=0.02)
    assert up == pytest.approx(parameters["MPC_Z_V_AUTO_UP"], rel=0.02)
    follower.go(60.0, (80.0, 60.0, -5.0))
    assert follower.fastest()[2] == pytest.approx(parameters["MPC_Z_V_AUTO_DN"], rel=0.02)
    assert all(math.isnan(each.yaw) for each in follower.told)


def test_limits_that_are_given_hold_and_scale_the_acceleration(parameters: Parameters) -> None:
    follower = Follower(parameters)
    follower.go(30.0, (20.0, 0.0, -10.0), max_horizontal_speed=1.0, max_vertical_speed=0.5)
    horizontal, up, _ = follower.fastest()
    assert horizontal == pytest.approx(1.0, rel=0.02)
    assert up == pytest.approx(0.5, rel=0.02)
    most = max(abs(each.acceleration[0]) for each in follower.told)
    assert most <= parameters["MPC_ACC_HOR"] / parameters["MPC_XY_CRUISE"] * 1.001
    assert math.dist((follower.here.x, follower.here.z), (20.0, -10.0)) < 0.01


def test_limits_beyond_the_vehicle_s_are_the_vehicle_s(parameters: Parameters) -> None:
    follower = Follower(parameters)
    follower.go(40.0, (80.0, 0.0, -5.0), max_horizontal_speed=99.0)
    assert follower.fastest()[0] == pytest.approx(parameters["MPC_XY_CRUISE"], rel=0.02)


def test_it_turns_no_faster_than_asked(parameters: Parameters) -> None:
    follower = Follower(parameters)
    follower.go(20.0, (0.0, 0.0, -5.0), heading=math.pi / 2, max_heading_rate=0.2)
    assert follower.told[-1].yaw == pytest.approx(math.pi / 2, abs=0.01)
    assert max(each.yawspeed for each in follower.told) == pytest.approx(0.2, rel=0.02)


def test_the_last_setpoint_stays_when_no_new_one_comes(parameters: Parameters) -> None:
    follower = Follower(parameters)
    follower.go(2.0, (50.0, 0.0, -5.0))
    before = len(follower.told)
    follower.go(2.0, (50.0, 0.0, -5.0), fresh=False)
    moved, stayed = follower.told[before : before + 20], follower.told[before + 30 :]
    assert moved[0].position[0] < moved[-1].position[0]
    assert len({each.position for each in stayed}) == 1


def test_where_nobody_knows_where_it_is_nothing_is_asked_of_it(parameters: Parameters) -> None:
    follower = Follower(parameters)
    follower.here = follower.here._replace(x=math.nan)
    follower.go(1.0, (50.0, 0.0, -5.0))
    assert all(math.isnan(each.position[0]) for each in follower.told)


@pytest.mark.parametrize("place", [(math.nan, 0.0, -5.0), (9.0, math.nan, -5.0), (9.0, 0.0, math.nan)])
def test_what_is_no_place_is_not_gone_to(parameters: Parameters, place: tuple[float, float, float]) -> None:
    """GotoControl::update: the last setpoint stays, and the next trajectory begins where the vehicle is."""
    follower = Follower(parameters)
    follower.go(3.0, (9.0, 0.0, -5.0))
    last = follower.told[-1]
    follower.go(1.0, place)
    assert follower.told[-1] == last
    follower.here = follower.here._replace(x=30.0)
    follower.go(DT_S, (9.0, 0.0, -5.0))
    assert follower.told[-1].position[0] == pytest.approx(30.0, abs=0.1)
