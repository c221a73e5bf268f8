"""STABILIZED and ACRO: what sticks make of attitude, rates and thrust; after PX4's controllers."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.autopilot.control.manual_attitude import ManualAttitude, super_expo
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import ManualControlSetpoint, VehicleAttitudeSetpoint, VehicleStatus
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.attitude import euler, heading, rotated, rotation

DT_S = 0.02
HOVER = 0.35
sticks_within = st.floats(-1.0, 1.0)


def manual(flown_s: float = 6.0, hover: float | None = HOVER, **parameters: float) -> ManualAttitude:
    """Armed for so long, in the air."""
    one = ManualAttitude(Parameters(VehicleKind.MULTICOPTER, parameters))
    for step in range(round(flown_s / DT_S)):
        one.follow(round(step * DT_S * 1e6), DT_S, VehicleStatus(armed=True, armed_time=0), False, hover)
    return one


def flown(
    one: ManualAttitude,
    heading_rad: float = 0.0,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
    throttle: float = 0.0,
) -> VehicleAttitudeSetpoint:
    sticks = ManualControlSetpoint(0, True, roll=roll, pitch=pitch, yaw=yaw, throttle=throttle)
    return one.attitude(0, DT_S, sticks, heading_rad)


def thrust(one: ManualAttitude, throttle: float) -> float:
    return -flown(one, throttle=throttle).thrust_body[2]


def test_the_middle_of_the_throttle_hovers_and_its_ends_are_the_limits() -> None:
    one = manual(20.0)
    assert thrust(one, 0.0) == pytest.approx(HOVER)
    assert thrust(one, 1.0) == pytest.approx(1.0)
    assert thrust(one, -1.0) == pytest.approx(0.08)
    assert thrust(one, 0.5) == pytest.approx((HOVER + 1.0) / 2.0)


@pytest.mark.parametrize(("curve", "middle"), [(0, HOVER), (1, 0.54), (2, 0.6)])
def test_the_curve_of_the_throttle(curve: int, middle: float) -> None:
    """MPC_THR_CURVE: by the estimate, straight from MPC_MANTHR_MIN to MPC_THR_MAX, by MPC_THR_HOVER."""
    assert thrust(manual(20.0, MPC_THR_CURVE=curve, MPC_THR_HOVER=0.6), 0.0) == pytest.approx(middle)


def test_hover_thrust_moves_slowly_from_the_parameter_to_the_estimate() -> None:
    assert thrust(manual(2.0, MPC_THR_HOVER=0.5), 0.0) == pytest.approx(0.5 - 2.0 * 0.05, abs=0.002)
    assert thrust(manual(hover=None, MPC_THR_HOVER=0.5), 0.0) == pytest.approx(0.5)


def test_after_arming_the_thrust_grows_and_on_the_ground_there_is_none_at_least() -> None:
    one = ManualAttitude(Parameters(VehicleKind.MULTICOPTER, {"COM_SPOOLUP_TIME": 1.0}))
    status = VehicleStatus(armed=True, armed_time=0)
    for step in range(round(2.0 / DT_S)):
        one.follow(round(step * DT_S * 1e6), DT_S, status, True, None)
    assert thrust(one, 1.0) == pytest.approx(0.5, abs=0.02)
    assert thrust(one, -1.0) == 0.0


@given(sticks_within, sticks_within, st.floats(-3.0, 3.0))
def test_the_tilt_is_in_the_direction_of_the_stick_and_limited(roll: float, pitch: float, yaw: float) -> None:
    one = manual(MPC_MAN_TILT_MAX=35.0)
    q = flown(one, yaw, roll=roll, pitch=pitch).q_d
    down = rotated(rotation(q), (0.0, 0.0, 1.0))
    tilt = math.acos(max(-1.0, min(1.0, down[2])))
    wanted = min(1.0, math.hypot(roll, pitch)) * math.radians(35.0)
    assert tilt == pytest.approx(wanted, abs=1e-4)
    if math.hypot(roll, pitch) > 0.05:
        towards = math.atan2(-down[1], -down[0]) - yaw
        assert math.cos(towards - math.atan2(roll, pitch)) == pytest.approx(1.0, abs=1e-3)


def test_a_heading_is_held_until_the_stick_turns_it() -> None:
    one = manual()
    assert heading(flown(one, 0.5).q_d) == pytest.approx(0.5)
    assert heading(flown(one, 0.9).q_d) == pytest.approx(0.5)  # blown aside: it turns back
    turning = flown(one, 0.9, yaw=1.0)
    assert turning.yaw_sp_move_rate > 0.0
    assert heading(turning.q_d) == pytest.approx(0.9)


def test_a_throttle_all_the_way_down_holds_no_heading() -> None:
    """The yaw stick may mean to arm then (MC_AIRMODE 2: it never does)."""
    one = manual()
    flown(one, 0.5)
    assert heading(flown(one, 0.9, throttle=-1.0).q_d) == pytest.approx(0.9)
    one = manual(MC_AIRMODE=2)
    flown(one, 0.5)
    assert heading(flown(one, 0.9, throttle=-1.0).q_d) == pytest.approx(0.5)


def test_a_stick_that_jumps_tilts_slowly_with_a_time_constant() -> None:
    one = manual(MC_MAN_TILT_TAU=0.3, MPC_MAN_TILT_MAX=30.0)
    pitches = [euler(flown(one, pitch=1.0).q_d)[1] for _ in range(round(0.3 / DT_S))]
    assert pitches == sorted(pitches, reverse=True)
    assert math.degrees(pitches[-1]) == pytest.approx(-30.0 * (1.0 - math.exp(-1.0)), abs=1.0)


def test_acro_sticks_are_rates_and_the_throttle_is_thrust() -> None:
    one = manual(MC_ACRO_R_MAX=100.0, MC_ACRO_P_MAX=200.0, MC_ACRO_Y_MAX=50.0)
    rates = one.rates(0, ManualControlSetpoint(0, True, roll=0.5, pitch=0.5, yaw=-1.0, throttle=0.0))
    assert [math.degrees(rate) for rate in rates.rates] == pytest.approx([50.0, -100.0, -50.0])
    assert rates.thrust_body == (0.0, 0.0, -0.5)


def test_acro_curves() -> None:
    one = manual(MC_ACRO_R_MAX=100.0, MC_ACRO_EXPO=0.5, MC_ACRO_SUPEXPO=0.5, MC_ACRO_SUPEXPOY=0.7, MC_ACRO_Y_MAX=100.0)
    roll, _, yaw = one.rates(0, ManualControlSetpoint(0, True, roll=0.5, yaw=0.5)).rates
    assert math.degrees(roll) == pytest.approx(100.0 * (0.25 + 0.0625) * 0.5 / 0.75)
    assert math.degrees(yaw) == pytest.approx(100.0 * 0.5 * 0.3 / 0.65)


@given(sticks_within, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_curve_keeps_its_ends_and_its_middle(value: float, cube: float, steepness: float) -> None:
    assert super_expo(0.0, cube, steepness) == 0.0
    assert super_expo(1.0, cube, steepness) == pytest.approx(1.0)
    assert super_expo(-value, cube, steepness) == -super_expo(value, cube, steepness)
    assert abs(super_expo(value, cube, steepness)) <= abs(value) + 1e-9
