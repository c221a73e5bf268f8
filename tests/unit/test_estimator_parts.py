"""The estimator's parts, each against its own mathematics."""

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.autopilot.commander.arming_checks.estimator import Validity
from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.aid_sources.gnss_checks import GnssChecks
from sitl_emu.autopilot.estimator.aid_sources.gravity import Gravity
from sitl_emu.autopilot.estimator.aid_sources.range_finder import Consistency
from sitl_emu.autopilot.estimator.bias_estimator import BiasEstimator
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.estimator import Settings
from sitl_emu.autopilot.estimator.imu_down_sampler import ImuDownSampler
from sitl_emu.autopilot.estimator.imu_filter import LowPass2p, NotchedLowPass2p, alpha
from sitl_emu.autopilot.estimator.output_predictor import OutputPredictor
from sitl_emu.autopilot.estimator.resets import reset_velocity
from sitl_emu.autopilot.estimator.samples import BaroSample, GnssSample, ImuSample, SampleBuffer
from sitl_emu.autopilot.estimator.state import State
from sitl_emu.autopilot.estimator.yaw_estimator import YawEstimator
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Vector3
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.attitude import euler, quaternion
from tests.typed import now

G = 9.80665
STEP_S = 0.008
FAST = 1e3


def imu(time_us: int, gyro: Vector3, accel: Vector3) -> ImuSample:
    turn = (gyro[0] * STEP_S, gyro[1] * STEP_S, gyro[2] * STEP_S)
    return ImuSample(time_us, turn, (accel[0] * STEP_S, accel[1] * STEP_S, accel[2] * STEP_S), STEP_S)


def moved(state: State, gyro: Vector3, accel: Vector3, steps: int) -> State:
    for _ in range(steps):
        state.predict(imu(0, gyro, accel), FAST)
    return state


# --- state ------------------------------------------------------------------------------------------------------


def test_at_rest_it_stays() -> None:
    state = moved(State(), (0.0, 0.0, 0.0), (0.0, 0.0, -G), 1000)
    assert (state.vn, state.ve, state.vd) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_it_turns_by_the_angle_of_its_rate() -> None:
    state = moved(State(), (0.0, 0.0, math.pi / 2), (0.0, 0.0, -G), 125)
    assert state.yaw == pytest.approx(math.pi / 2, abs=1e-4)
    assert math.fsum(c * c for c in state.q) == pytest.approx(1.0, abs=1e-8)


def test_it_falls_by_half_g_t_squared() -> None:
    state = moved(State(), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 125)
    assert state.alt == pytest.approx(-G / 2, rel=1e-6)
    assert state.vd == pytest.approx(G, rel=1e-6)


def test_biases_are_taken_off_and_so_is_the_turn_of_the_earth() -> None:
    state = State()
    state.set_latitude(90.0)
    state.gravity_m_s2 = G
    state.gyro_bias, state.accel_bias = (0.1, -0.05, 0.02), (0.2, -0.1, 0.3)
    moved(state, (0.1, -0.05, 0.02 - 7.292115e-5), (0.2, -0.1, 0.3 - G), 125)
    assert euler(state.q) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert (state.vn, state.ve, state.vd) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


# --- covariance -------------------------------------------------------------------------------------------------


def disturbed(error: list[float]) -> State:
    """A state after 0.1 s of turning and accelerating, which began with an error."""
    state = State()
    state.set_attitude(quaternion(0.2, -0.3, 1.0))
    state.vn, state.ve, state.vd = 3.0, -2.0, 0.5
    state.correct(error, math.inf, math.inf, mag=True, wind=True)
    state.restart_sums()
    return moved(state, (0.3, -0.2, 0.5), (1.5, -2.0, -11.0), 12)


def difference(a: State, b: State) -> list[float]:
    """Error state of b seen from a."""
    aw, ax, ay, az = a.q
    bw, bx, by, bz = b.q
    # b * conj(a): the small rotation in NED
    x = -bw * ax + bx * aw - by * az + bz * ay
    y = -bw * ay + bx * az + by * aw - bz * ax
    z = -bw * az - bx * ay + by * ax + bz * aw
    change = [b.vn - a.vn, b.ve - a.ve, b.vd - a.vd, b.pn - a.pn, b.pe - a.pe, a.alt - b.alt]
    others = [
        p - q
        for mine, yours in ((b.gyro_bias, a.gyro_bias), (b.accel_bias, a.accel_bias))
        for p, q in zip(mine, yours, strict=True)
    ]
    return [2 * x, 2 * y, 2 * z, *change, *others]


@pytest.mark.parametrize("broken", [-4.0, math.nan, math.inf])
def test_a_covariance_that_can_not_be_computed_with_begins_anew(broken: float) -> None:
    """PX4 resets it where an innovation's variance says that it has lost its meaning."""
    ekf = Ekf(Settings(Parameters(VehicleKind.MULTICOPTER, {})))
    ekf.begin_step(imu(8000, (0.0, 0.0, 0.0), (0.0, 0.0, -G)))
    as_new = ekf.p.copy()
    h = np.zeros(cov.STATES)
    h[cov.VELOCITY] = 1.0
    for fuse in ("fuse", "fuse_by", "fuse_state"):
        ekf.p[cov.VELOCITY, cov.VELOCITY] = broken
        ph, innovation_variance = ekf.innovation_variance(h, 1.0)
        if fuse == "fuse":
            ekf.fuse(ph, 1.0, innovation_variance)
        elif fuse == "fuse_by":
            ekf.fuse_by(0.5 * h, ph, 1.0, innovation_variance)
        else:
            ekf.fuse_state(cov.VELOCITY, 1.0, innovation_variance, 1.0)
            ekf.apply()
        assert ekf.p == pytest.approx(as_new)
        assert all(map(math.isfinite, (*ekf.state.q, ekf.state.vn, ekf.state.ve, ekf.state.vd)))


def test_no_variance_grows_beyond_px4s_limit() -> None:
    ekf = Ekf(Settings(Parameters(VehicleKind.MULTICOPTER, {})))
    ekf.p[cov.TERRAIN, cov.TERRAIN] = 3e4
    for step in range(1, 400):
        ekf.begin_step(imu(step * 8000, (0.0, 0.0, 0.0), (0.0, 0.0, -G)))
        if step == 1:
            ekf.p[cov.TERRAIN, cov.TERRAIN] = 3e4
    assert 0.8e4 < ekf.variance(cov.TERRAIN) <= 1e4


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_setting_is_larger_than_can_be_computed_with(sign: float) -> None:
    parameters = Parameters(VehicleKind.MULTICOPTER, {})
    parameters.set("EKF2_IMU_POS_Z", sign * 3.4e38)
    assert Settings(parameters)["EKF2_IMU_POS_Z"] == sign * 1e9


@pytest.mark.parametrize("limit", [math.nan, -3.4e38, 3.4e38, math.inf, 0.0])
def test_no_limit_however_set_makes_the_state_infinite(limit: float) -> None:
    settings = Settings(Parameters(VehicleKind.MULTICOPTER, {}))
    settings |= {"EKF2_VEL_LIM": limit, "EKF2_GYR_B_LIM": limit, "EKF2_ABL_LIM": limit}
    ekf = Ekf(settings)
    for step in range(1, 200):
        ekf.begin_step(imu(step * 8000, (0.0, 0.0, 0.0), (0.0, 0.0, -G)))
        ekf.fuse_state(cov.VELOCITY, 1.0, 2.0, 1.0)
        ekf.fuse_state(cov.ACCEL_BIAS, 1.0, 2.0, 1.0)
        ekf.apply()
    state = ekf.state
    assert all(map(math.isfinite, (state.vn, state.ve, state.vd, *state.accel_bias, *state.gyro_bias)))
    assert math.hypot(state.vn, state.ve, state.vd) < 2000.0


@pytest.mark.parametrize("index", range(15))
def test_the_transition_is_the_derivative_of_the_prediction(index: int) -> None:
    reference = disturbed([0.0] * cov.STATES)
    size = 1e-4
    error = [0.0] * cov.STATES
    error[index] = size
    measured = np.array(difference(reference, disturbed(error))) / size
    transition = cov.transition()
    force = (reference.dvn, reference.dve, reference.dvd)
    cov.predict(np.identity(cov.STATES), transition, reference.rotation, force, reference.dt_s)
    whole = np.identity(cov.STATES)
    whole[:9, :15] = transition
    # First order in a step of 0.1 s: the terms of second order (half dt squared times 10 m/s²) are left out.
    assert whole[:15, index] == pytest.approx(measured, abs=0.06)


@given(seed=st.integers(0, 99))
def test_the_prediction_is_what_the_whole_transition_makes_of_the_covariance(seed: int) -> None:
    root = np.random.default_rng(seed).normal(size=(cov.STATES, cov.STATES))
    prior = root @ root.T
    p, transition = prior.copy(), cov.transition()
    state = disturbed([0.0] * cov.STATES)
    cov.predict(p, transition, state.rotation, (state.dvn, state.dve, state.dvd), state.dt_s)
    whole = np.identity(cov.STATES)
    whole[:9, :15] = transition
    assert p == pytest.approx(whole @ prior @ whole.T, abs=1e-8)


@given(innovation_variance=st.floats(0.01, 100), seed=st.integers(0, 99), index=st.integers(0, 23))
def test_updates_are_kalmans_and_josephs(innovation_variance: float, seed: int, index: int) -> None:
    random_numbers = np.random.default_rng(seed)
    root = random_numbers.normal(size=(cov.STATES, cov.STATES))
    prior = root @ root.T
    h = np.zeros(cov.STATES)
    h[index] = 1.0
    ph = prior @ h
    own = float(ph @ h) + innovation_variance
    kalman = ph / own
    best = (np.identity(cov.STATES) - np.outer(kalman, h)) @ prior
    posterior = prior.copy()
    cov.update_optimal(posterior, kalman, ph)
    assert posterior == pytest.approx(best, abs=1e-8)
    gain = kalman * random_numbers.uniform(size=cov.STATES)
    rest = np.identity(cov.STATES) - np.outer(gain, h)
    joseph = rest @ prior @ rest.T + innovation_variance * np.outer(gain, gain)
    posterior = prior.copy()
    cov.update(posterior, gain, ph, own)
    assert posterior == pytest.approx(joseph, abs=1e-7)


def test_what_is_uncorrelated_has_no_correlation() -> None:
    covariance = np.ones((cov.STATES, cov.STATES))
    cov.uncorrelate(covariance, 6, (4.0, 4.0))
    assert covariance[6, 6] == covariance[7, 7] == 4.0
    assert covariance[6, 7] == covariance[0, 6] == covariance[14, 7] == 0.0
    assert covariance[8, 8] == 1.0


# --- samples ----------------------------------------------------------------------------------------------------


def baro(time_us: int) -> BaroSample:
    return BaroSample(time_us, 100.0, reset=False)


def test_a_buffer_gives_what_the_horizon_has_reached_and_forgets_the_rest() -> None:
    buffer: SampleBuffer[BaroSample] = SampleBuffer(20)
    for time_us in (100_000, 150_000, 200_000):
        assert buffer.push(time_us + 5_000, baro(time_us), 10_000)
    assert not buffer.push(210_000, baro(205_000), 10_000), "too close behind the one before"
    assert buffer.pop(99_000) is None
    found = buffer.pop(160_000)
    assert found is not None and found.time_us == 150_000
    assert buffer.pop(160_000) is None
    newest = buffer.newest()
    assert newest is not None and newest.time_us == 200_000
    assert buffer.pop(900_000) is None, "too old"


def test_two_samples_of_four_milliseconds_make_a_step() -> None:
    sampler, taken = ImuDownSampler(10_000.0), []
    for tick in range(1, 201):
        if sampler.update(tick * 4_000, 0.004, 0.0, 0.0, 0.0, 0.0, -G * 0.004, 0.004):
            taken.append(sampler.take())
    steps = [sample.dt_s for sample in taken[20:]]
    assert steps == pytest.approx([0.008] * len(steps))
    assert taken[-1].delta_angle == pytest.approx((0.008, 0.0, 0.0), abs=1e-6)
    assert taken[-1].delta_velocity[2] == pytest.approx(-G * 0.008, rel=1e-4)


# --- output predictor -------------------------------------------------------------------------------------------


def test_the_output_draws_near_to_the_filter() -> None:
    output = OutputPredictor(20)
    output.align((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    output.gravity_m_s2 = G
    truth = quaternion(0.0, 0.0, 0.1)
    for _ in range(1500):
        for _ in range(2):
            output.update(0.0, 0.0, 0.0, 0.0, 0.0, -G * 0.004, 0.004)
        nothing: Vector3 = (0.0, 0.0, 0.0)
        output.correct(0.152, 0.008, truth, nothing, (1.0, -2.0, 3.0), (nothing, nothing), (0.25, 0.25))
    assert euler(output.q)[2] == pytest.approx(0.1, abs=1e-3)
    assert (output.pn, output.pe, output.pd) == pytest.approx((1.0, -2.0, 3.0), abs=0.02)
    assert (output.vn, output.ve, output.vd, output.z_deriv) == pytest.approx((0.0, 0.0, 0.0, 0.0), abs=0.02)
    assert max(output.tracking_error) < 0.02


def test_an_output_that_has_lost_the_filter_begins_anew() -> None:
    output = OutputPredictor(20)
    output.align((1.0, 0.0, 0.0, 0.0), (1e30, 0.0, 0.0), (0.0, 0.0, 1e38))
    output.update(0.0, 0.0, 0.0, 0.0, 0.0, -G * 0.004, 0.004)
    nothing: Vector3 = (0.0, 0.0, 0.0)
    output.correct(0.152, 0.008, (1.0, 0.0, 0.0, 0.0), (1.0, 2.0, 3.0), nothing, (nothing, nothing), (0.25, 0.25))
    assert (output.vn, output.ve, output.vd, output.z_deriv) == (1.0, 2.0, 3.0, 3.0)
    assert (output.pn, output.pe, output.pd) == nothing


def test_a_turn_of_the_filter_turns_past_and_present() -> None:
    output = OutputPredictor(20)
    output.reset_quaternion(quaternion(0.0, 0.0, 1.0))
    assert euler(output.q)[2] == pytest.approx(1.0)


# --- checks and biases ------------------------------------------------------------------------------------------


def test_an_aid_filters_its_test_ratio_with_the_sign_of_the_innovation() -> None:
    aid = AidSource(1)
    for tick in range(1, 100):
        aid.update(tick * 50_000, (1.0,), (1.0,), (-2.0,), (1.0,), 5.0)
    assert aid.test_ratio[0] == pytest.approx(4.0 / 25.0)
    assert aid.test_ratio_filtered[0] == pytest.approx(-4.0 / 25.0, abs=1e-3)
    assert not now(aid.innovation_rejected)
    aid.update(5_000_000, (1.0,), (1.0,), (6.0,), (1.0,), 5.0)
    assert now(aid.innovation_rejected)
    aid.clip(0)
    assert aid.innovation[0] == pytest.approx(5.0) and not aid.innovation_rejected


def test_a_bias_is_found_and_followed_slowly() -> None:
    bias, rng = BiasEstimator(), random.Random(1)
    for _ in range(2000):
        bias.predict(0.13, 0.05)
        bias.fuse(2.0 + rng.gauss(0.0, 0.2), 0.04, 2.0, 0.05)
    assert bias.bias == pytest.approx(2.0, abs=0.3)
    bias.fuse(30.0, 0.04, 2.0, 0.05)
    assert bias.bias < 4.0


@pytest.mark.parametrize(("climb_m_s", "consistent"), [(-1.0, True), (1.0, False)])
def test_a_range_has_to_change_as_the_vehicle_climbs(climb_m_s: float, consistent: bool) -> None:
    check = Consistency()
    for tick in range(1, 400):
        distance = 5.0 + tick * 0.05 if consistent else 5.0
        check.update(tick * 50_000, (distance, 0.0001), (-1.0, 0.01), 1.0, moving=False)
    assert check.consistent is consistent
    assert climb_m_s


def fix(**other: float) -> GnssSample:
    good = GnssSample(
        time_us=0, lat=47.0, lon=8.0, alt=488.0, vel=(0.0, 0.0, 0.0), hacc=0.9, vacc=1.8, sacc=0.3, fix_type=3,
        nsats=10, pdop=1.2,
    )  # fmt: skip
    return good._replace(**other)  # type: ignore[arg-type]


@pytest.mark.parametrize("bad", [{"fix_type": 2}, {"nsats": 5}, {"hacc": 3.5}, {"vacc": 5.5}, {"sacc": 0.6}])
def test_gnss_checks_want_good_fixes_without_a_break(bad: dict[str, float]) -> None:
    ekf = Ekf(Settings(Parameters(VehicleKind.MULTICOPTER, {"EKF2_REQ_GPS_H": 0.5})))
    ekf.flags.in_air = False
    checks = GnssChecks(ekf)

    def run(time_us: int, sample: GnssSample) -> bool:
        ekf.time_us = time_us
        return checks.run(sample)

    assert not run(1_000_000, fix())
    assert not run(1_400_000, fix())
    assert run(1_600_000, fix())
    assert not run(1_700_000, fix(**bad))
    assert checks.failures.mask()
    assert not run(1_800_000, fix())
    assert now(checks.failures.mask()) == 0


def test_an_estimate_has_to_be_well_for_a_second_and_may_then_be_worse() -> None:
    validity = Validity()

    def look(now_us: int, error: float) -> bool:
        return validity.update(now_us, valid=True, timestamp=now_us, error=error, limit=1.0)

    assert not look(1, 2.0)
    assert not look(900_000, 0.5)
    assert look(1_100_000, 0.5)
    assert look(1_200_000, 2.4)
    assert not look(1_300_000, 2.6)
    assert not look(1_400_000, 0.5)


def test_gravity_felt_over_some_steps_weighs_as_much_as_one_by_one() -> None:
    """PX4 fuses it at each of its steps of 8 ms (controlGravityFusion)."""
    tilts = []
    for together in (1, 4):
        ekf = Ekf(Settings(Parameters(VehicleKind.MULTICOPTER, {})))
        ekf.begin_step(imu(8000, (0.0, 0.0, 0.0), (0.0, 0.0, -G)))
        ekf.state.set_attitude(quaternion(0.05, -0.03, 0.0))
        ekf.flags.tilt_align, gravity = True, Gravity(ekf)
        dt_s = together * STEP_S
        for _ in range(80 // together):
            ekf.time_us += round(dt_s * 1e6)
            gathered = ImuSample(ekf.time_us, (0.0, 0.0, 0.0), (0.0, 0.0, -G * dt_s), dt_s)
            gravity.control(gathered, together)
            assert gravity.aid.fused
        tilts.append((ekf.tilt_variance(), *euler(ekf.state.q)[:2]))
    assert tilts[1] == pytest.approx(tilts[0], rel=0.01)
    assert tilts[0][0] < 0.9 * 2 * 0.1**2


def test_the_yaw_estimator_finds_the_heading_by_acceleration() -> None:
    yaw, heading = YawEstimator(), 1.0
    speed = 0.0
    for step in range(2500):
        accelerating = step > 250
        forward = 2.0 * math.sin(0.01 * step) if accelerating else 0.0
        speed += forward * STEP_S
        yaw.predict(imu(step * 8_000, (0.0, 0.0, 0.0), (forward, 0.0, -G)), 1, (0.0,) * 3, at_rest=False, flying=True)
        if step % 16 == 0:
            yaw.fuse_velocity(speed * math.cos(heading), speed * math.sin(heading), 0.3, in_air=accelerating)
    assert yaw.converged
    assert yaw.yaw == pytest.approx(heading, abs=0.1)
    assert yaw.record(1, 1).yaw_composite_valid


# --- filters ----------------------------------------------------------------------------------------------------


def gain_at(filtered: LowPass2p, frequency_hz: float) -> float:
    outputs = [filtered.update(math.sin(math.tau * frequency_hz * n / 250.0), 0.0, 0.0)[0] for n in range(2000)]
    return max(outputs[1000:])


def test_gyro_filter_halves_the_power_at_its_cutoff() -> None:
    assert gain_at(LowPass2p(250.0, 40.0), 40.0) == pytest.approx(math.sqrt(0.5), abs=0.01)
    assert gain_at(LowPass2p(250.0, 40.0), 4.0) == pytest.approx(1.0, abs=0.01)
    assert gain_at(LowPass2p(250.0, 0.0), 100.0) == pytest.approx(1.0, abs=0.06)
    assert alpha(0.0, 0.004) == 1.0


def test_notches_take_their_frequencies_out_of_the_gyro_and_leave_the_others() -> None:
    """IMU_GYRO_NF0_FRQ, IMU_GYRO_NF1_FRQ (VehicleAngularVelocity.cpp)."""
    for frequency_hz, gain in ((60.0, 0.0), (90.0, 0.0), (5.0, 1.0)):
        filtered = NotchedLowPass2p(250.0, 0.0, [(60.0, 20.0), (90.0, 20.0)])
        assert gain_at(filtered, frequency_hz) == pytest.approx(gain, abs=0.02)


def test_a_velocity_that_can_not_be_is_not_taken_over() -> None:
    """Hostile optical flow at 1e38 rad/s once was; PX4 limits its state to 1000 m/s (constrainStates)."""
    ekf = Ekf(Settings(Parameters(VehicleKind.MULTICOPTER, {})))
    ekf.begin_step(imu(8000, (0.0, 0.0, 0.0), (0.0, 0.0, -G)))
    reset_velocity(ekf, (-8e40, 3.0, 1e39), (1.0, 1.0, 1.0))
    assert (ekf.state.vn, ekf.state.ve, ekf.state.vd) == (-1000.0, 3.0, 1000.0)
    assert (ekf.output.vn, ekf.output.ve, ekf.output.vd) == (-1000.0, 3.0, 1000.0)
