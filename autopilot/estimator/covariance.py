"""The filter's covariance: 24 error states, predicted and updated with numpy, in place.

Error states in PX4's order (src/modules/ekf2/EKF, state.h, v1.18): attitude (3, small rotation in NED, rad), velocity
NED (3), position NED (3), gyro bias (3), accelerometer bias (3), Earth's magnetic field (3), magnetic bias of the body
(3), wind NE (2), terrain (1). This is the error-state filter with the global angular error (Solà, "Quaternion
kinematics for the error-state Kalman filter", 2017). Noise parameters mean what they mean in PX4 (covariance.cpp): each
adds the square of noise times step at every step of the filter. PX4 predicts at every step; here eight steps are
predicted at once, which neglects what attitude errors do to position within these 64 ms.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[Any]
STATES: Final = 24
ATTITUDE: Final = 0
VELOCITY: Final = 3
POSITION: Final = 6
GYRO_BIAS: Final = 9
ACCEL_BIAS: Final = 12
MAG_I: Final = 15
MAG_B: Final = 18
WIND: Final = 21
TERRAIN: Final = 23
YAW: Final = ATTITUDE + 2
HEIGHT: Final = POSITION + 2
MOVING: Final = 9
DRIVING: Final = 15
"""States that change by themselves, and those that make them change."""
FLOOR: Final = np.array([1e-9] * 3 + [1e-6] * 6 + [1e-9] * 6 + [0.0] * 9)
CEILING: Final = np.array([1.0] * 3 + [1e6] * 6 + [1.0] * 12 + [1e6] * 2 + [1e4])
"""PX4's limits of variances (constrainStateVariances)."""
LEAST_MAG: Final = 1e-6
"""kMagVarianceMin."""
LEAST_WIND: Final = 1e-6


def transition() -> Matrix:
    """The part of the transition matrix that is not an identity's, (9, 15), at rest; `predict` overwrites it."""
    return np.eye(MOVING, DRIVING)


def predict(p: Matrix, a: Matrix, rotation: tuple[float, ...], force: tuple[float, float, float], dt_s: float) -> None:
    """Propagate `p` over `dt_s`: `rotation` body to NED by rows, `force` the specific force integrated in NED (m/s).

    `a` is `transition`'s, kept between calls.
    """
    a[0:3, 9:12] = a[3:6, 12:15] = np.array(rotation).reshape(3, 3) * -dt_s
    dvn, dve, dvd = force
    a[3, 1], a[3, 2], a[4, 0], a[4, 2], a[5, 0], a[5, 1] = dvd, -dve, -dvd, dvn, dve, -dvn
    a[6, 3] = a[7, 4] = a[8, 5] = dt_s
    moved = a @ p[:DRIVING]
    others = moved[:, MOVING:]
    p[:MOVING, MOVING:] = others
    p[MOVING:, :MOVING] = others.T
    np.matmul(moved[:, :DRIVING], a.T, out=p[:MOVING, :MOVING])


def update(p: Matrix, gain: Matrix, ph: Matrix, innovation_variance: float) -> None:
    """Joseph's update for any gain, in place: `ph` is P·H, `innovation_variance` H·P·H + R."""
    half = gain[:, np.newaxis] * (ph - (0.5 * innovation_variance) * gain)
    p -= half
    p -= half.T


def update_optimal(p: Matrix, gain: Matrix, ph: Matrix) -> None:
    """The same for Kalman's own gain, `ph` / innovation variance, which is shorter."""
    p -= gain[:, np.newaxis] * ph


def update_one(p: Matrix, index: int, gain: float, ph: Matrix, innovation_variance: float) -> None:
    """The same for a gain that is zero but for state `index`."""
    variance = float(p[index, index]) - 2.0 * gain * float(ph[index]) + gain * gain * innovation_variance
    row = p[index] - gain * ph
    row[index] = variance
    p[index] = row
    p[:, index] = row


def uncorrelate(p: Matrix, first: int, variances: tuple[float, ...]) -> None:
    """Make states from `first` on independent of all others, with these variances."""
    last = first + len(variances)
    p[first:last, :] = 0.0
    p[:, first:last] = 0.0
    for index, variance in enumerate(variances, first):
        p[index, index] = variance


def too_large(p: Matrix) -> list[int]:
    """The states whose variances have grown beyond their limits."""
    return np.flatnonzero(p.diagonal() > CEILING).tolist()


def variances(p: Matrix) -> Matrix:
    """The diagonal, as a view that may be written to."""
    return p.reshape(-1)[:: STATES + 1]


def raise_to_floor(diagonal: Matrix, *, mag: bool, wind: bool) -> None:
    """Keep the variances from vanishing; those of the magnetic field and of wind while they are estimated."""
    np.maximum(diagonal, FLOOR, out=diagonal)
    if mag:
        np.maximum(diagonal[MAG_I:WIND], LEAST_MAG, out=diagonal[MAG_I:WIND])
    if wind:
        np.maximum(diagonal[WIND:TERRAIN], LEAST_WIND, out=diagonal[WIND:TERRAIN])
