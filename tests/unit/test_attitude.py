"""Quaternions and Euler angles: they mean the same rotation, whichever way it is written."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.attitude import (
    Quaternion,
    after_small_turn,
    euler,
    heading,
    product,
    quaternion,
    rotated,
    rotation,
)
from sitl_emu.core.geodesy import wrap_pi

ROLL_OR_YAW = st.floats(-math.pi + 1e-3, math.pi - 1e-3)
PITCH = st.floats(-1.5, 1.5)
SMALL_RAD = st.floats(-0.02, 0.02)
ATTITUDE = st.builds(quaternion, ROLL_OR_YAW, PITCH, ROLL_OR_YAW)


def turned(q: Quaternion, vector: tuple[float, float, float]) -> tuple[float, ...]:
    """A vector turned by the definition: q · v · q*."""
    w, x, y, z = q
    return product(product(q, (0.0, *vector)), (w, -x, -y, -z))[1:]


@given(ROLL_OR_YAW, PITCH, ROLL_OR_YAW)
def test_euler_angles_come_back(roll: float, pitch: float, yaw: float) -> None:
    q = quaternion(roll, pitch, yaw)
    assert euler(q) == pytest.approx((roll, pitch, yaw), abs=1e-6)
    assert heading(q) == pytest.approx(yaw, abs=1e-6)


def test_straight_up_all_turning_is_yaw() -> None:
    assert euler(quaternion(0.0, math.pi / 2, 0.7)) == pytest.approx((0.0, math.pi / 2, 0.7))


def test_what_is_not_known_has_no_heading() -> None:
    assert math.isnan(heading(quaternion(0.0, 0.0, math.nan)))


@given(ATTITUDE)
def test_a_rotation_matrix_turns_as_its_quaternion_does(q: Quaternion) -> None:
    matrix = rotation(q)
    for axis, unit in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
        assert matrix[axis::3] == pytest.approx(turned(q, unit), abs=1e-9)
        assert rotated(matrix, unit) == matrix[axis::3]


def test_yaw_turns_north_to_east() -> None:
    assert rotation(quaternion(0.0, 0.0, math.pi / 2))[0::3] == pytest.approx((0.0, 1.0, 0.0), abs=1e-9)


@given(ATTITUDE, SMALL_RAD, SMALL_RAD, SMALL_RAD)
def test_a_small_turn_is_the_turn_by_its_angle(q: Quaternion, x: float, y: float, z: float) -> None:
    angle = math.sqrt(x * x + y * y + z * z)
    sine = math.sin(angle / 2) / angle if angle else 0.5
    exact = product(q, (math.cos(angle / 2), x * sine, y * sine, z * sine))
    after = after_small_turn(q, x / 2, y / 2, z / 2)
    assert after == pytest.approx(exact, abs=2e-6)
    assert sum(part * part for part in after) == pytest.approx(1.0, abs=1e-6)


@given(st.floats(-50.0, 50.0))
def test_an_angle_that_is_wrapped_keeps_its_direction(angle: float) -> None:
    assert -math.pi <= wrap_pi(angle) < math.pi
    assert math.cos(wrap_pi(angle)) == pytest.approx(math.cos(angle), abs=1e-9)


@pytest.mark.parametrize("half_turns", [-3, -1, 1, 3])
def test_half_a_turn_is_one_to_the_left(half_turns: int) -> None:
    """matrix::wrap_pi: from -π to less than π."""
    assert wrap_pi(half_turns * math.pi) == -math.pi
