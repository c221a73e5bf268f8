"""The nose turns into the wind (WV_EN): PX4's lib/weather_vane, in modes that fly by themselves and by sticks."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import ManualControlSetpoint, VehicleAttitudeSetpoint
from sitl_emu.core.attitude import quaternion
from tests.unit.modes_follower import STEP_S, Follower

from .navigation_fake import FakeVehicle


def leaning(follower: Follower, roll_deg: float, heading: float = 0.0) -> None:
    """What the controllers hold against the wind."""
    q = quaternion(math.radians(roll_deg), 0.0, heading)
    follower.topics.vehicle_attitude_setpoint = VehicleAttitudeSetpoint(follower.now_us, q)


def holding(nav_state: NavState = NavState.AUTO_LOITER, **changes: float) -> Follower:
    """A vehicle that stands in the air, its sticks centred."""
    follower = Follower(20.0, nav_state, **{"WV_EN": 1, **changes})
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True)
    follower.go((0.0, 0.0, 20.0))
    return follower


@pytest.mark.parametrize(
    ("nav_state", "position_mode"), [(NavState.AUTO_LOITER, 4), (NavState.POSCTL, 4), (NavState.POSCTL, 0)]
)
@pytest.mark.parametrize(("roll_deg", "deg_s"), [(0.9, 0.0), (6.0, 10.0), (-6.0, -10.0), (30.0, 12.0)])
def test_it_turns_to_the_side_to_which_it_leans(
    nav_state: NavState, position_mode: int, roll_deg: float, deg_s: float
) -> None:
    """By 2 Hz of what goes past 1 degree, no faster than 12 degrees a second."""
    follower = holding(nav_state, WV_GAIN=2.0, WV_YRATE_MAX=12.0, MPC_POS_MODE=position_mode)
    follower.fly(0.5)
    leaning(follower, roll_deg, follower.topics.vehicle_local_position.heading)
    setpoint = follower.fly(STEP_S)[-1].setpoint
    assert math.isnan(setpoint.yaw)
    assert math.degrees(setpoint.yawspeed) == pytest.approx(deg_s, abs=0.05)


def test_a_lean_counts_from_the_heading() -> None:
    follower = holding()
    follower.place(0.0, 0.0, 20.0, heading=math.pi / 2)
    leaning(follower, 0.0)
    pitched = quaternion(0.0, math.radians(-6.0), 0.0)  # to the north, which is to the left of a nose that looks east
    follower.topics.vehicle_attitude_setpoint = VehicleAttitudeSetpoint(1, pitched)
    assert math.degrees(follower.fly(STEP_S)[-1].setpoint.yawspeed) == pytest.approx(-5.0, abs=0.05)


def test_a_heading_that_is_wanted_goes_before() -> None:
    follower = holding()
    follower.go((0.0, 0.0, 20.0), yaw=0.0)
    leaning(follower, 6.0)
    assert follower.fly(0.5)[-1].setpoint.yaw == pytest.approx(0.0, abs=1e-6)


def test_on_its_way_it_keeps_its_heading() -> None:
    follower = holding()
    follower.go((200.0, 0.0, 20.0))
    leaning(follower, 6.0)
    setpoint = follower.fly(8.0)[-1].setpoint
    assert math.isnan(setpoint.yaw) and setpoint.yawspeed == 0.0


def test_a_stick_that_is_let_go_leaves_the_heading_to_the_wind() -> None:
    follower = holding(MPC_AUTO_NUDGING=1)
    leaning(follower, 6.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, yaw=1.0)
    assert follower.fly(2.0)[-1].setpoint.yawspeed > math.radians(30.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(3, True)
    leaning(follower, 6.0, follower.topics.vehicle_local_position.heading)
    setpoint = follower.fly(STEP_S)[-1].setpoint
    assert math.isnan(setpoint.yaw) and math.degrees(setpoint.yawspeed) == pytest.approx(5.0, abs=0.5)


@pytest.mark.parametrize(("wv_en", "is_told"), [(0, True), (1, False)])
def test_a_return_asks_for_no_heading_then(wv_en: int, is_told: bool) -> None:
    """PX4's RtlDirect::set_rtl_item."""
    vehicle = FakeVehicle(WV_EN=wv_en, RTL_TYPE=0, RTL_RETURN_ALT=30.0)
    vehicle.run(3.0)
    vehicle.take_off(10.0)
    vehicle.set_mode(4, 5)
    vehicle.run(0.5)
    assert math.isfinite(vehicle.topics.position_setpoint_triplet.current.yaw) is is_told
