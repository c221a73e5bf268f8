"""The control laws of a multicopter, each by itself."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.autopilot.constants import TakeoffState
from sitl_emu.autopilot.control.control_allocator import ControlAllocator, Rotor, desaturate, mixer, saturation
from sitl_emu.autopilot.control.hover_thrust_estimator import HoverThrustEstimator, HoverThrustParameters
from sitl_emu.autopilot.control.mc_allocation import output_channels
from sitl_emu.autopilot.control.mc_att_control import AttitudeReference, rates_setpoint
from sitl_emu.autopilot.control.mc_pos_control import (
    Limits,
    PositionControl,
    PositionControlGains,
    States,
    attitude_of_thrust,
    complete,
    constrain_xy,
    failsafe_setpoint,
)
from sitl_emu.autopilot.control.mc_rate_control import RateControl
from sitl_emu.autopilot.control.takeoff import TakeoffHandling
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    Quaternion,
    TrajectorySetpoint,
    Vector3,
)
from sitl_emu.core.attitude import quaternion
from tests.typed import now

G = 9.80665
QUAD = [
    Rotor(x, y, 0.0, 0.0, 0.0, -1.0, 6.5, km)
    for x, y, km in ((0.15, 0.25, 0.05), (-0.15, -0.19, 0.05), (0.15, -0.25, -0.05), (-0.15, 0.19, -0.05))
]
HEXA = [
    Rotor(math.cos(angle), math.sin(angle), 0.0, 0.0, 0.0, -1.0, 6.5, 0.05 * (-1) ** n)
    for n, angle in enumerate(math.radians(30 + 60 * k) for k in range(6))
]
GAINS = PositionControlGains(0.95, 1.0, 1.8, 0.4, 0.2, 4.0, 2.0, 0.0, 0.3, True)
LIMITS = Limits(12.0, 3.0, 1.5, 0.12, 1.0, math.radians(45.0))
STILL = States((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
torque = st.floats(-1.0, 1.0)


# --- allocation -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rotors", [QUAD, HEXA])
def test_thrust_goes_to_all_motors_alike(rotors: list[Rotor]) -> None:
    motors = ControlAllocator(rotors, 0.0).allocate(0.0, 0.0, 0.0, -0.5)
    assert sum(motors) / len(motors) == pytest.approx(0.5)
    if rotors is HEXA:
        assert motors == pytest.approx([0.5] * 6)


@pytest.mark.parametrize("rotors", [QUAD, HEXA])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_torque_turns_the_right_way_and_no_other(rotors: list[Rotor], axis: int) -> None:
    command = [0.0, 0.0, 0.0]
    command[axis] = 0.1
    motors = ControlAllocator(rotors, 0.0).allocate(command[0], command[1], command[2], -0.5)
    thrusts = [m * r.ct for m, r in zip(motors, rotors, strict=True)]
    got = (
        sum(-f * r.py for f, r in zip(thrusts, rotors, strict=True)),
        sum(f * r.px for f, r in zip(thrusts, rotors, strict=True)),
        sum(f * r.km for f, r in zip(thrusts, rotors, strict=True)),
    )
    assert got[axis] > 0.001
    for other in {0, 1, 2} - {axis}:
        assert abs(got[other]) < 1e-2 * got[axis] + 1e-9 or abs(got[other]) < 0.02 * abs(got[axis])
    assert sum(motors) / len(motors) == pytest.approx(0.5, abs=1e-3)


def test_geometry_counts_without_its_unit() -> None:
    larger = [r._replace(px=r.px * 7, py=r.py * 7) for r in HEXA]
    for a, b in zip(mixer(HEXA), mixer(larger), strict=True):
        assert a == pytest.approx(b)


@pytest.mark.parametrize(("km", "turns"), [(0.007, False), (0.008, True)])
def test_an_axis_along_which_the_motors_do_next_to_nothing_is_not_controlled(km: float, turns: bool) -> None:
    """ControlAllocator::update_effectiveness_matrix_if_needed: thrust coefficient times moment ratio up to 0.05."""
    weak = [rotor._replace(km=math.copysign(km, rotor.km)) for rotor in HEXA]
    allocator = ControlAllocator(weak, 0.0)
    motors = allocator.allocate(0.0, 0.0, 0.1, -0.5)
    assert (max(motors) - min(motors) > 0.01) is turns


def test_a_rotor_that_gives_no_thrust_does_not_count() -> None:
    """ActuatorEffectivenessRotors::addActuators, updateControlAllocationMatrixScale."""
    *others, last = ControlAllocator([*HEXA, HEXA[0]._replace(ct=0.0)], 0.0).allocate(0.0, 0.0, 0.0, -0.5)
    assert others == pytest.approx([0.5] * 6) and last == 0.0


@given(roll=torque, pitch=torque, yaw=torque, thrust=st.floats(0.0, 1.0))
def test_motors_stay_within_their_range(roll: float, pitch: float, yaw: float, thrust: float) -> None:
    for rotors in (QUAD, HEXA):
        motors = ControlAllocator(rotors, 1.0).allocate(roll, pitch, yaw, -thrust)
        assert all(0.0 <= m <= 1.0 for m in motors)


def test_roll_is_kept_and_yaw_given_up_when_motors_saturate() -> None:
    allocator = ControlAllocator(HEXA, 0.0)
    allocator.allocate(0.3, 0.0, 0.9, -0.5)
    roll, pitch, yaw = allocator.unallocated
    assert roll == pytest.approx(0.0, abs=1e-6) and pitch == pytest.approx(0.0, abs=1e-6)
    assert yaw > 0.3
    allocator.allocate(0.1, 0.0, 0.0, -0.5)
    assert allocator.unallocated == (0.0, 0.0, 0.0)


def test_thrust_gives_way_to_roll_at_full_throttle() -> None:
    motors = ControlAllocator(HEXA, 0.0).allocate(0.2, 0.0, 0.0, -1.0)
    assert max(motors) == pytest.approx(1.0)
    assert max(motors) - min(motors) == pytest.approx(2 * 0.2 * max(mixer(HEXA)[0]), rel=1e-6)


@pytest.mark.parametrize(("air_mode", "roll_kept", "yaw_kept"), [(0, False, False), (1, True, False), (2, True, True)])
def test_in_airmode_it_turns_without_throttle(air_mode: int, roll_kept: bool, yaw_kept: bool) -> None:
    """MC_AIRMODE: thrust gets more, for roll and pitch, or for yaw too (mixAirmodeRP, mixAirmodeRPY)."""
    for index, kept in ((0, roll_kept), (1, roll_kept), (2, yaw_kept)):
        allocator = ControlAllocator(HEXA, 0.0, air_mode)
        asked = [0.0, 0.0, 0.0]
        asked[index] = 0.2
        motors = allocator.allocate(asked[0], asked[1], asked[2], 0.0)
        assert (abs(allocator.unallocated[index]) < 1e-6) is kept
        assert (sum(motors) > 0.1) is kept and all(0.0 <= motor <= 1.0 for motor in motors)


def test_in_airmode_thrust_gives_way_at_full_throttle_all_the_same() -> None:
    for air_mode in (1, 2):
        allocator = ControlAllocator(HEXA, 0.0, air_mode)
        motors = allocator.allocate(0.2, 0.0, 0.0, -1.0)
        assert max(motors) == pytest.approx(1.0) and abs(allocator.unallocated[0]) < 1e-6


def test_a_motor_that_does_little_along_an_axis_brings_nobody_back_by_it() -> None:
    """ControlAllocationSequentialDesaturation::computeDesaturationGain."""
    ends = [(0.0, 1.0)] * 2
    assert desaturate([1.3, 0.5], [0.19, 1.0], ends) == [1.3, 0.5]
    assert desaturate([1.3, 0.5], [0.2, 1.0], ends) != [1.3, 0.5]


def test_with_the_pseudo_inverse_alone_each_motor_ends_at_its_limit() -> None:
    """CA_METHOD 0 (ControlAllocationPseudoInverse): mixed, then cut off, and thrust does not give way."""
    allocator = ControlAllocator(HEXA, 0.0, desaturates=False)
    roll = mixer(HEXA)[0]
    motors = allocator.allocate(0.2, 0.0, 0.0, -1.0)
    assert motors == pytest.approx([min(1.0, 1.0 + 0.2 * share) for share in roll])
    assert allocator.unallocated[0] > 0.05 and allocator.unallocated_thrust < -0.05


def test_motors_that_turn_both_ways_do() -> None:
    """CA_R_REV: ControlAllocator::update_effectiveness_matrix_if_needed gives them -1 as their least."""
    both_ways = ControlAllocator(HEXA, 1.0, reversible_flags=0b111111)
    motors = both_ways.allocate(0.2, 0.0, 0.0, 0.0)
    assert motors == pytest.approx([math.copysign(math.sqrt(abs(0.2 * share)), share) for share in mixer(HEXA)[0]])
    assert both_ways.unallocated == (0.0, 0.0, 0.0)
    assert saturation([-0.5, 0.0, -1.0, 0.0], 0b0111)[:4] == (0, 0, -2, -2)
    one = ControlAllocator(HEXA, 0.0, 0, (2.0,) * 6, 0b1)
    assert one.allocate(0.0, 0.0, 0.0, -0.5, 0.1)[:2] == pytest.approx((0.1, 0.05)), "it has twice as far to go"
    with_one = ControlAllocator(HEXA, 0.0, reversible_flags=0b1).allocate(0.5, 0.5, 0.5, 0.5)
    assert -1.0 <= min(with_one) < 0.0 and min(with_one[1:]) == 0.0


def test_a_motor_with_a_slew_rate_takes_its_time() -> None:
    """CA_Rn_SLEW, seconds from end to end (ControlAllocation::applySlewRateLimit); what it lacks is told."""
    allocator = ControlAllocator(HEXA, 0.0, 0, (2.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    steps = [allocator.allocate(0.0, 0.0, 0.0, -0.5, 0.1)[:2] for _ in range(12)]
    assert steps[0] == pytest.approx((0.05, 0.5)) and steps[3] == pytest.approx((0.2, 0.5))
    assert steps[-1] == pytest.approx((0.5, 0.5)) and allocator.unallocated_thrust == 0.0
    assert allocator.allocate(0.0, 0.0, 0.0, 0.0, 0.1)[0] == pytest.approx(0.45)
    assert allocator.unallocated_thrust > 0.0
    allocator.rest()
    assert allocator.allocate(0.0, 0.0, 0.0, -0.5, 0.1)[0] == pytest.approx(0.05)


def test_thrust_model_is_undone() -> None:
    for factor in (0.3, 1.0):
        signal = ControlAllocator(HEXA, factor).allocate(0.0, 0.0, 0.0, -0.4)[0]
        assert factor * signal**2 + (1.0 - factor) * signal == pytest.approx(0.4)


def test_outputs_follow_pwm_main_func() -> None:
    assert output_channels([101, 102, 103, 104, 0, 0]) == [0, 1, 2, 3]
    assert output_channels([102, 0, 101, 201]) == [1, -1, 0, -1]  # a servo, which OFFBOARD may move
    assert output_channels([101, 0, 306, 0]) == [0, -1, -1]


# --- attitude ---------------------------------------------------------------------------------------------

ATTITUDE_GAINS = (4.0, 4.0, 2.8 / 0.4)
RATE_LIMITS = (3.8, 3.8, 3.5)


def test_small_errors_give_rates_by_their_gain() -> None:
    level = (1.0, 0.0, 0.0, 0.0)
    for axis, gain in enumerate((4.0, 4.0, 2.8)):
        angles = [0.0, 0.0, 0.0]
        angles[axis] = 0.01
        rates = rates_setpoint(level, quaternion(*angles), 0.0, ATTITUDE_GAINS, 0.4, RATE_LIMITS)
        assert rates[axis] == pytest.approx(gain * 0.01, rel=1e-3)


def test_tilt_comes_before_yaw() -> None:
    rates = rates_setpoint((1.0, 0.0, 0.0, 0.0), quaternion(0.5, 0.0, 2.0), 0.0, ATTITUDE_GAINS, 0.4, (99.0,) * 3)
    alone = rates_setpoint((1.0, 0.0, 0.0, 0.0), quaternion(0.5, 0.0, 0.0), 0.0, ATTITUDE_GAINS, 0.4, (99.0,) * 3)
    assert math.hypot(rates[0], rates[1]) == pytest.approx(alone[0], rel=0.25)
    assert rates[2] < 2.8 * 2.0


def test_both_signs_of_a_quaternion_are_one_attitude() -> None:
    q, target = quaternion(0.1, -0.2, 1.0), quaternion(-0.3, 0.2, -2.0)
    flipped: Quaternion = (-target[0], -target[1], -target[2], -target[3])
    one = rates_setpoint(q, target, 0.0, ATTITUDE_GAINS, 0.4, RATE_LIMITS)
    other = rates_setpoint(q, flipped, 0.0, ATTITUDE_GAINS, 0.4, RATE_LIMITS)
    assert one == pytest.approx(other)


def test_rates_are_limited_and_yaw_rate_is_fed_forward() -> None:
    level = (1.0, 0.0, 0.0, 0.0)
    assert rates_setpoint(level, quaternion(3.0, 0.0, 0.0), 0.0, ATTITUDE_GAINS, 0.4, RATE_LIMITS)[0] == 3.8
    assert rates_setpoint(level, level, 0.5, ATTITUDE_GAINS, 0.4, RATE_LIMITS) == pytest.approx((0.0, 0.0, 0.5))
    upside_down = (0.0, 1.0, 0.0, 0.0)
    assert max(map(abs, rates_setpoint(level, upside_down, 0.0, ATTITUDE_GAINS, 0.4, RATE_LIMITS))) == 3.8


@given(roll=st.floats(-1, 1), pitch=st.floats(-1, 1), yaw=st.floats(-3, 3), other=st.floats(-3, 3))
def test_attitude_law_converges_from_anywhere(roll: float, pitch: float, yaw: float, other: float) -> None:
    q, target = quaternion(roll, pitch, yaw), quaternion(-pitch, roll / 2, other)
    for _ in range(2000):
        x, y, z = rates_setpoint(q, target, 0.0, ATTITUDE_GAINS, 0.4, RATE_LIMITS)
        w0, x0, y0, z0 = q
        h = 0.002
        q = (
            w0 - (x0 * x + y0 * y + z0 * z) * h,
            x0 + (w0 * x + y0 * z - z0 * y) * h,
            y0 + (w0 * y + z0 * x - x0 * z) * h,
            z0 + (w0 * z + x0 * y - y0 * x) * h,
        )
        size = math.sqrt(sum(c * c for c in q))
        q = (q[0] / size, q[1] / size, q[2] / size, q[3] / size)
    assert abs(sum(a * b for a, b in zip(q, target, strict=True))) == pytest.approx(1.0, abs=1e-4)


# --- position -----------------------------------------------------------------------------------------------


def flown(setpoint: TrajectorySetpoint, states: States = STILL, limits: Limits = LIMITS) -> Vector3:
    return PositionControl().update(setpoint, states, GAINS, limits, 0.008)


def test_hover_needs_hover_thrust() -> None:
    assert flown(TrajectorySetpoint(0, (0.0, 0.0, 0.0))) == pytest.approx((0.0, 0.0, -0.5))


@pytest.mark.parametrize(("decouple", "leans"), [(True, False), (False, True)])
def test_what_is_held_down_on_the_ground_is_level_unless_height_counts_for_the_tilt(
    decouple: bool, leans: bool
) -> None:
    """MPC_ACC_DECOUPLE 0: straight down, tilted by the limit (ControlMath::limitTilt, exactly parallel vectors)."""
    down = TrajectorySetpoint(0, NAN3, NAN3, (0.0, 0.0, 100.0))
    gains = GAINS._replace(decouple=decouple)
    north, east, up = PositionControl().update(down, STILL, gains, LIMITS, 0.008)
    tilt = LIMITS.tilt if leans else 0.0
    assert math.atan2(-north, -up) == pytest.approx(tilt) and east == 0.0


def test_gains_act_as_named() -> None:
    n, e, d = flown(TrajectorySetpoint(0, NAN3, (0.5, 0.0, -0.25)))
    tilt_acceleration = -n / d * G
    assert tilt_acceleration == pytest.approx(0.5 * 1.8)
    assert d == pytest.approx(-0.5 - 0.25 * 4.0 * 0.5 / G)
    assert e == 0.0


def test_position_error_is_a_speed_within_the_limit() -> None:
    control = PositionControl()
    control.update(TrajectorySetpoint(0, (1.0, 0.0, -100.0)), STILL, GAINS, LIMITS, 0.008)
    assert control.velocity_sp == pytest.approx((0.95, 0.0, -3.0))
    control.update(TrajectorySetpoint(0, (100.0, 100.0, 100.0)), STILL, GAINS, LIMITS, 0.008)
    assert math.hypot(*control.velocity_sp[:2]) == pytest.approx(12.0)
    assert control.velocity_sp[2] == 1.5


@given(n=st.floats(-30, 30), e=st.floats(-30, 30), d=st.floats(-30, 30))
def test_thrust_and_tilt_stay_within_their_limits(n: float, e: float, d: float) -> None:
    tn, te, td = flown(TrajectorySetpoint(0, NAN3, NAN3, (n, e, d)))
    size = math.sqrt(tn * tn + te * te + td * td)
    assert size <= 1.0 + 1e-9
    assert size >= 0.12 - 1e-9
    assert math.atan2(math.hypot(tn, te), -td) <= math.radians(45.0) + 1e-9


def test_vertical_comes_first_but_leaves_a_margin() -> None:
    tn, _, td = flown(TrajectorySetpoint(0, NAN3, NAN3, (30.0, 0.0, -30.0)))
    assert tn == pytest.approx(0.3, abs=1e-6)
    assert td == pytest.approx(-math.sqrt(1.0 - 0.09), abs=1e-6)


def test_integrator_takes_out_a_steady_error_but_does_not_wind_up() -> None:
    control = PositionControl()
    blown = STILL._replace(velocity=(-1.0, 0.0, 0.0))
    for _ in range(125):
        control.update(TrajectorySetpoint(0, NAN3, (0.0, 0.0, 0.0)), blown, GAINS, LIMITS, 0.008)
    assert control.acceleration_sp[0] == pytest.approx(1.8 + 0.4, abs=0.02)
    far = STILL._replace(velocity=(-50.0, 0.0, 20.0))
    for _ in range(1250):
        control.update(TrajectorySetpoint(0, NAN3, (0.0, 0.0, 0.0)), far, GAINS, LIMITS, 0.008)
    control.update(TrajectorySetpoint(0, NAN3, (0.0, 0.0, 0.0)), STILL, GAINS, LIMITS, 0.008)
    assert control.acceleration_sp[0] < 10.0
    assert control.acceleration_sp[2] >= -G


def test_a_new_hover_thrust_does_not_jerk() -> None:
    control = PositionControl()
    climb = TrajectorySetpoint(0, NAN3, (0.0, 0.0, -1.0))
    before = control.update(climb, STILL, GAINS, LIMITS, 1e-9)
    control.update_hover_thrust(0.4)
    after = control.update(climb, STILL, GAINS, LIMITS, 1e-9)
    assert after[2] == pytest.approx(before[2], abs=1e-6)


@given(a=st.tuples(*[st.floats(-9, 9)] * 2), b=st.tuples(*[st.floats(-9, 9)] * 2))
def test_first_vector_has_priority(a: tuple[float, float], b: tuple[float, float]) -> None:
    n, e = constrain_xy(*a, *b, 5.0)
    assert math.hypot(n, e) <= 5.0 + 1e-6
    if math.hypot(*a) >= 5.0 and math.hypot(a[0] + b[0], a[1] + b[1]) > 5.0:
        assert (n, e) == pytest.approx((a[0] / math.hypot(*a) * 5.0, a[1] / math.hypot(*a) * 5.0))


@given(n=st.floats(-1, 1), e=st.floats(-1, 1), d=st.floats(-1, -0.1), yaw=st.floats(-3.1, 3.1))
def test_attitude_points_along_the_thrust_and_keeps_the_heading(n: float, e: float, d: float, yaw: float) -> None:
    (w, x, y, z), size = attitude_of_thrust((n, e, d), yaw)
    up = (-2 * (x * z + w * y), -2 * (y * z - w * x), -(1 - 2 * (x * x + y * y)))
    assert [c * size for c in up] == pytest.approx([n, e, d], abs=1e-6)
    heading = math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    assert math.remainder(heading - yaw, math.tau) == pytest.approx(0.0, abs=1e-6)


def reference(**parameters: float) -> AttitudeReference:
    """At rest and level."""
    one = AttitudeReference()
    one.set_parameters(parameters.get("w_n", 50.0), parameters.get("ff", 0.0), parameters.get("ff_max", 0.0))
    one.follow((1.0, 0.0, 0.0, 0.0), 0.0, 0.0)
    return one


@pytest.mark.parametrize("dt_s", [0.004, 0.008, 0.02])
def test_the_attitude_that_is_followed_is_a_critically_damped_step(dt_s: float) -> None:
    """1 - (1 + w t) exp(-w t), whatever the steps are (small angles)."""
    one, small = reference(), 0.02
    for _ in range(round(0.04 / dt_s)):
        one.follow(quaternion(small, 0.0, 0.0), 0.0, dt_s)
    assert 2.0 * one.q[1] == pytest.approx(small * (1.0 - 3.0 * math.exp(-2.0)), rel=1e-3)


def test_the_first_setpoint_and_one_after_nobody_knows_how_long_are_followed_at_once() -> None:
    one = reference()
    one.follow(quaternion(0.5, 0.1, 1.0), 0.0, 0.0)
    assert one.q == pytest.approx(quaternion(0.5, 0.1, 1.0))


def test_a_yaw_rate_that_is_commanded_turns_the_reference_and_nothing_else_is_fed_forward_of_it() -> None:
    one = reference(ff=1.0)
    for step in range(50):
        one.follow(quaternion(0.0, 0.0, 0.01 * step), 1.0, 0.01)
    assert one.feed_forward(one.q)[2] == pytest.approx(0.0, abs=1e-6)
    assert 2.0 * math.atan2(one.q[3], one.q[0]) == pytest.approx(0.5, abs=0.03)


def test_the_rate_of_the_reference_is_fed_forward_and_limited() -> None:
    one = reference(ff=0.5, ff_max=0.3)
    one.follow(quaternion(0.3, 0.0, 0.0), 0.0, 0.01)
    assert one.feed_forward(one.q)[0] == pytest.approx(0.3)
    assert reference().feed_forward((1.0, 0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)


def test_a_jump_of_the_heading_turns_the_reference() -> None:
    one = reference()
    one.turned(0.4)
    assert one.q == pytest.approx(quaternion(0.0, 0.0, 0.4))


def test_a_setpoint_that_cannot_be_flown_stops_and_sinks_only_where_it_cannot_stop() -> None:
    stops = failsafe_setpoint(STILL, 0.7)
    assert stops.velocity == (0.0, 0.0, 0.0)
    assert math.isnan(stops.yaw)
    blind = failsafe_setpoint(STILL._replace(velocity=(NAN, NAN, 0.0)), 0.7)
    assert (blind.velocity[2], blind.acceleration[:2]) == (0.7, (0.0, 0.0))
    falling = failsafe_setpoint(STILL._replace(velocity=(0.0, 0.0, NAN)), 0.7)
    assert (math.isnan(falling.velocity[2]), falling.acceleration[2]) == (True, 0.3)


def test_incomplete_setpoints_are_told_and_replaced() -> None:
    assert complete(TrajectorySetpoint(0, (0.0, 0.0, NAN), (NAN, NAN, 0.5)), STILL)
    assert not complete(TrajectorySetpoint(0, (0.0, 0.0, NAN)), STILL), "nothing for the height"
    assert not complete(TrajectorySetpoint(0, (0.0, NAN, 0.0)), STILL), "half a position"
    blind = States((NAN, NAN, 0.0), (NAN, NAN, 0.0), (0.0, 0.0, 0.0), 0.0)
    assert not complete(TrajectorySetpoint(0, (0.0, 0.0, 0.0)), blind)
    for states in (STILL, blind, States(NAN3, NAN3, NAN3, 0.0)):
        setpoint = failsafe_setpoint(states, 0.7)
        assert complete(setpoint, states)
        assert all(math.isfinite(c) for c in flown(setpoint, states))


# --- rates, takeoff, hover thrust -----------------------------------------------------------------------------


def rate_control() -> RateControl:
    control = RateControl()
    control.gain_p, control.gain_i, control.gain_d = (0.15,) * 3, (0.2,) * 3, (0.003,) * 3
    control.int_limit = (0.3,) * 3
    return control


def test_rate_law() -> None:
    roll, pitch, yaw = rate_control().update(
        (0.1, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 2.0, 0.0), 0.004, False, (0.0, 0.0, 0.0)
    )
    assert (roll, pitch, yaw) == pytest.approx((0.15 * 0.2, -0.003 * 2.0, 0.0))


@pytest.mark.parametrize(
    ("landed", "unallocated", "expected"),
    [(False, 0.0, 0.2 * 0.5), (True, 0.0, 0.0), (False, 0.1, 0.0), (False, -0.1, 0.2 * 0.5)],
)
def test_integrator_stops_on_the_ground_and_in_saturation(landed: bool, unallocated: float, expected: float) -> None:
    control = rate_control()
    for _ in range(250):
        control.update((0.0,) * 3, (0.5, 0.0, 0.0), (0.0,) * 3, 0.004, landed, (unallocated, 0.0, 0.0))
    after, _, _ = control.update((0.0,) * 3, (0.0,) * 3, (0.0,) * 3, 0.004, True, (0.0,) * 3)
    assert after == pytest.approx(expected, rel=0.01)


def test_integrator_is_limited() -> None:
    control = rate_control()
    for _ in range(5000):
        control.update((0.0,) * 3, (0.5, 0.0, 0.0), (0.0,) * 3, 0.004, False, (0.0,) * 3)
    assert control.update((0.0,) * 3, (0.0,) * 3, (0.0,) * 3, 0.004, True, (0.0,) * 3)[0] == pytest.approx(0.3)


def test_takeoff_spools_up_waits_ramps_and_flies() -> None:
    takeoff = TakeoffHandling()
    takeoff.update_state(0, True, True, True, 1.0)
    assert now(takeoff.state) is TakeoffState.SPOOLUP
    assert takeoff.update_ramp(0.01, 1.5, 3.0, 4.0) == 0.0
    takeoff.update_state(1_000_000, True, True, False, 1.0)
    assert now(takeoff.state) is TakeoffState.READY_FOR_TAKEOFF
    takeoff.update_state(1_100_000, True, True, True, 1.0)
    assert now(takeoff.state) is TakeoffState.RAMPUP
    speeds = [takeoff.update_ramp(0.01, 1.5, 3.0, 4.0) for _ in range(300)]
    assert speeds[0] == pytest.approx(-G / 4.0, abs=0.05) and speeds == sorted(speeds)
    assert speeds[-1] == pytest.approx(1.5, abs=0.02)
    takeoff.update_ramp(0.01, 1.5, 3.0, 4.0)
    takeoff.update_state(5_000_000, True, False, True, 1.0)
    assert now(takeoff.state) is TakeoffState.FLIGHT
    takeoff.update_state(6_000_000, True, True, False, 1.0)
    assert now(takeoff.state) is TakeoffState.READY_FOR_TAKEOFF
    takeoff.update_state(6_100_000, False, True, False, 1.0)
    assert takeoff.state == TakeoffState.DISARMED


HOVER_PARAMETERS = HoverThrustParameters(0.5, 0.1, 0.0036, 3.0, 0.2, 10.0, 10.0)


@given(true_hover=st.floats(0.35, 0.65))
def test_hover_thrust_is_learnt(true_hover: float) -> None:
    estimator = HoverThrustEstimator(HOVER_PARAMETERS)
    for n in range(2000):
        thrust = true_hover * (1.0 + 0.1 * math.sin(n * 0.1))
        estimator.update(n * 8000, 0.008, G * (thrust / true_hover - 1.0), thrust, 0.0, 0.0)
    assert estimator.estimate.hover_thrust == pytest.approx(true_hover, abs=0.02)
    learnt = estimator.estimate
    assert learnt.valid
    estimator.stop(20_000_000, armed=True)
    stopped = estimator.estimate
    assert not stopped.valid
    assert math.isnan(stopped.hover_thrust)


def test_hover_thrust_learns_less_in_fast_motion() -> None:
    slow, fast = HoverThrustEstimator(HOVER_PARAMETERS), HoverThrustEstimator(HOVER_PARAMETERS)
    slow.update(8000, 0.008, 1.0, 0.5, 0.0, 0.0)
    fast.update(8000, 0.008, 1.0, 0.5, 12.0, 0.0)
    assert fast.estimate.accel_innov_var == pytest.approx(slow.estimate.accel_innov_var + 5.0 * (9.0 - 1.0), rel=0.01)
    assert slow.estimate.hover_thrust < fast.estimate.hover_thrust < 0.5


def test_hover_thrust_keeps_within_its_range() -> None:
    estimator = HoverThrustEstimator(HOVER_PARAMETERS)
    for n in range(4000):
        estimator.update(n * 8000, 0.008, 0.0, 0.15, 0.0, 0.0)
    assert estimator.estimate.hover_thrust == pytest.approx(0.3)
