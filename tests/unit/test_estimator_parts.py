"""The estimator's parts, each against its own mathematics."""

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot.estimator import covariance as cov
from autopilot.estimator.alignment import Alignment
from autopilot.estimator.gps_checks import GpsChecks
from autopilot.estimator.height_bias import HeightBias
from autopilot.estimator.imu_filter import LowPass2p, alpha
from autopilot.estimator.strapdown import Strapdown
from autopilot.estimator.terrain import Terrain
from autopilot.parameters import Parameters
from autopilot.topics import SensorGps, Vector3
from sitl_emu.core.attitude import quaternion
from tests.typed import now

G = 9.80665
RANGE_NOISE = (0.1, 0.05, 5.0, 5.0, 0.5)


def euler_of(rotation: tuple[float, ...]) -> Vector3:
    return (
        math.atan2(rotation[7], rotation[8]),
        math.asin(-rotation[6]),
        math.atan2(rotation[3], rotation[0]),
    )


def test_strapdown_at_rest_stays() -> None:
    state = Strapdown()
    for _ in range(2500):
        state.predict((0.0, 0.0, 0.0), (0.0, 0.0, -G), 0.004)
    assert (state.vn, state.ve, state.vd) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_strapdown_turns_by_the_angle_of_its_rate() -> None:
    state = Strapdown()
    for _ in range(250):
        state.predict((0.0, 0.0, math.pi / 2), (0.0, 0.0, -G), 0.004)
    assert euler_of(state.rotation)[2] == pytest.approx(math.pi / 2, abs=1e-4)
    assert math.fsum(c * c for c in state.q) == pytest.approx(1.0, abs=1e-9)


def test_strapdown_falls_by_half_g_t_squared() -> None:
    state = Strapdown()
    for _ in range(250):
        state.predict((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.004)
    assert state.pd == pytest.approx(G / 2, rel=1e-6)
    assert state.vd == pytest.approx(G, rel=1e-6)


def test_biases_are_taken_off() -> None:
    state = Strapdown()
    state.gyro_bias, state.accel_bias = (0.1, -0.05, 0.02), (0.2, -0.1, 0.3)
    for _ in range(250):
        state.predict((0.1, -0.05, 0.02), (0.2, -0.1, 0.3 - G), 0.004)
    assert euler_of(state.rotation) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert (state.vn, state.ve, state.vd) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def moving(error: list[float]) -> Strapdown:
    """A state after 0.1 s of turning and accelerating, which began with an error."""
    state = Strapdown()
    state.q, state.vn, state.ve, state.vd = quaternion(0.2, -0.3, 1.0), 3.0, -2.0, 0.5
    state.correct(error, math.inf, math.inf)
    state.restart_sums()
    for _ in range(25):
        state.predict((0.3, -0.2, 0.5), (1.5, -2.0, -11.0), 0.004)
    return state


def difference(a: Strapdown, b: Strapdown) -> list[float]:
    """Error state of b seen from a."""
    aw, ax, ay, az = a.q
    bw, bx, by, bz = b.q
    # b * conj(a): the small rotation in NED
    x = -bw * ax + bx * aw - by * az + bz * ay
    y = -bw * ay + bx * az + by * aw - bz * ax
    z = -bw * az - bx * ay + by * ax + bz * aw
    moved = [b.vn - a.vn, b.ve - a.ve, b.vd - a.vd, b.pn - a.pn, b.pe - a.pe, b.pd - a.pd]
    gyro = [p - q for p, q in zip(b.gyro_bias, a.gyro_bias, strict=True)]
    accel = [p - q for p, q in zip(b.accel_bias, a.accel_bias, strict=True)]
    return [2 * x, 2 * y, 2 * z, *moved, *gyro, *accel]


@pytest.mark.parametrize("index", range(cov.STATES))
def test_transition_is_the_derivative_of_the_strapdown(index: int) -> None:
    reference = moving([0.0] * cov.STATES)
    size = 1e-4
    error = [0.0] * cov.STATES
    error[index] = size
    measured = np.array(difference(reference, moving(error))) / size
    transition = np.identity(cov.STATES)
    delta_velocity = (reference.dvn, reference.dve, reference.dvd)
    noise = np.zeros(cov.STATES)
    cov.predict(np.identity(cov.STATES), list(reference.rotation), delta_velocity, reference.dt_s, noise, transition)
    # First order in a step of 0.1 s: the terms of second order (half dt squared times 10 m/s²) are left out.
    assert transition[:, index] == pytest.approx(measured, abs=0.06)


@given(index=st.integers(0, 14), innovation=st.floats(-5, 5), variance=st.floats(0.01, 100), seed=st.integers(0, 99))
def test_fuse_is_kalmans_update(index: int, innovation: float, variance: float, seed: int) -> None:
    root = np.random.default_rng(seed).normal(size=(15, 15))
    prior = root @ root.T
    h = np.zeros((1, 15))
    h[0, index] = 1.0
    gain = prior @ h.T / (h @ prior @ h.T + variance)
    posterior, correction = prior.copy(), np.zeros(15)
    cov.fuse(posterior, correction, index, innovation, variance)
    assert posterior == pytest.approx((np.identity(15) - gain @ h) @ prior, abs=1e-8)
    assert correction == pytest.approx(gain[:, 0] * innovation, abs=1e-9)


def test_a_batch_counts_what_it_has_already_corrected() -> None:
    covariance, correction = np.identity(15), np.zeros(15)
    cov.fuse(covariance, correction, 3, 1.0, 1.0)
    cov.fuse(covariance, correction, 3, 1.0, 1.0)
    assert correction[3] == pytest.approx(2 / 3)
    assert covariance[3, 3] == pytest.approx(1 / 3)


def test_forget_leaves_no_correlation() -> None:
    covariance = np.ones((15, 15))
    cov.forget(covariance, 6, 2, 4.0)
    assert covariance[6, 6] == covariance[7, 7] == 4.0
    assert covariance[6, 7] == covariance[0, 6] == covariance[14, 7] == 0.0
    assert covariance[8, 8] == 1.0


@given(roll=st.floats(-0.5, 0.5), pitch=st.floats(-0.5, 0.5), yaw=st.floats(-3.1, 3.1))
def test_alignment_finds_any_attitude_at_rest(roll: float, pitch: float, yaw: float) -> None:
    truth = Strapdown()
    truth.q = quaternion(roll, pitch, yaw)
    truth.predict((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1e-9)
    r = truth.rotation
    declination = 0.06
    field = (0.2 * math.cos(declination), 0.2 * math.sin(declination), 0.43)

    def to_body(v: Vector3) -> Vector3:
        return (
            r[0] * v[0] + r[3] * v[1] + r[6] * v[2],
            r[1] * v[0] + r[4] * v[1] + r[7] * v[2],
            r[2] * v[0] + r[5] * v[1] + r[8] * v[2],
        )

    alignment = Alignment()
    for _ in range(75):
        alignment.on_imu((0.0, 0.0, 0.0), to_body((0.0, 0.0, -G)))
        alignment.on_mag(to_body(field))
    assert alignment.tilt_ready() and alignment.heading_ready()
    q = alignment.attitude(declination)
    assert abs(sum(a * b for a, b in zip(q, truth.q, strict=True))) == pytest.approx(1.0, abs=1e-9)


def test_alignment_waits_until_it_stands_still() -> None:
    alignment = Alignment()
    for _ in range(74):
        alignment.on_imu((0.0, 0.0, 0.0), (0.0, 0.0, -G))
    alignment.on_imu((0.5, 0.0, 0.0), (0.0, 0.0, -G))
    alignment.on_imu((0.0, 0.0, 0.0), (0.0, 0.0, -G))
    assert not alignment.tilt_ready()


def gain_at(filtered: LowPass2p, frequency_hz: float) -> float:
    outputs = [filtered.update(math.sin(math.tau * frequency_hz * n / 250.0), 0.0, 0.0)[0] for n in range(2000)]
    return max(outputs[1000:])


def test_gyro_filter_halves_the_power_at_its_cutoff() -> None:
    assert gain_at(LowPass2p(250.0, 40.0), 40.0) == pytest.approx(math.sqrt(0.5), abs=0.01)
    assert gain_at(LowPass2p(250.0, 40.0), 4.0) == pytest.approx(1.0, abs=0.01)
    assert gain_at(LowPass2p(250.0, 0.0), 100.0) == pytest.approx(1.0, abs=0.06)
    assert alpha(0.0, 0.004) == 1.0


def test_height_bias_finds_an_offset_and_follows_slowly() -> None:
    bias, rng = HeightBias(), random.Random(1)
    for _ in range(2000):
        bias.update(2.0 + rng.gauss(0.0, 0.2), 0.04, 0.05)
    assert bias.bias_m == pytest.approx(2.0, abs=0.1)
    bias.update(12.0, 0.04, 0.05)
    assert bias.bias_m < 4.0


def test_terrain_needs_a_fresh_range_and_little_tilt() -> None:
    terrain = Terrain()
    terrain.update(1_000_000, 5.0, 0.5, -5.0, 0.0, RANGE_NOISE)
    assert not terrain.valid(1_000_000)
    terrain.update(1_000_000, 5.0, 0.9, -4.5, 0.0, RANGE_NOISE)
    assert terrain.valid(1_000_000)
    assert terrain.down_m == pytest.approx(0.0)
    assert not terrain.valid(2_100_000)


def test_terrain_refuses_a_wild_range() -> None:
    terrain = Terrain()
    for tick in range(20):
        terrain.update(tick * 50_000, 5.0, 1.0, -5.0, 0.0, RANGE_NOISE)
    terrain.update(1_000_000, 0.3, 1.0, -5.0, 0.0, RANGE_NOISE)
    assert terrain.down_m == pytest.approx(0.0, abs=0.01)


def fix(**other: float) -> SensorGps:
    good = SensorGps(0, 47.0, 8.0, 488.0, 0.0, 0.0, 0.0, 0.9, 1.8, 3, 10)
    return good._replace(**other)  # type: ignore[arg-type]


@pytest.mark.parametrize("bad", [{"fix_type": 2}, {"satellites_used": 5}, {"eph": 3.5}, {"epv": 5.5}])
def test_gps_checks_want_good_fixes_without_a_break(bad: dict[str, float]) -> None:
    parameters = Parameters("multicopter", {"EKF2_REQ_GPS_H": 0.5})
    checks = GpsChecks(parameters)
    checks.update(0, fix())
    checks.update(400_000, fix())
    assert not now(checks.passed)
    checks.update(500_000, fix())
    assert now(checks.passed)
    checks.update(600_000, fix(**bad))
    assert not checks.passed
    checks.update(700_000, fix())
    assert not checks.passed
