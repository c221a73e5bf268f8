"""The filter's covariance: 15 error states, predicted and updated with numpy.

Error states, in this order: attitude (3, small rotation in NED, rad), velocity NED (3), position NED (3), gyro bias
(3, rad/s), accelerometer bias (3, m/s²). This is the usual error-state filter (Solà, "Quaternion kinematics for the
error-state Kalman filter", 2017, with the global angular error), with the noise parameters and their meaning as in
PX4's EKF2 (src/modules/ekf2/EKF/covariance.cpp, v1.18), which adds the square of noise times step at every 10 ms
step. Magnetic field and wind, states 16 to 24 of EKF2, are left out.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.topics import Vector3

Matrix = NDArray[Any]
STATES = 15
ATTITUDE, VELOCITY, POSITION, GYRO_BIAS, ACCEL_BIAS = 0, 3, 6, 9, 12
EKF_STEP_S = 0.01
"""EKF2_PREDICT_US: the step to which PX4's noise parameters refer."""


def initial(
    tilt_rad: float, yaw_rad: float, velocity_m_s: float, position_m: float, gyro_bias: float, accel_bias: float
) -> Matrix:
    """Covariance at the start: standard deviations on the diagonal."""
    sigmas = [tilt_rad, tilt_rad, yaw_rad] + [velocity_m_s] * 3 + [position_m] * 3 + [gyro_bias] * 3 + [accel_bias] * 3
    return np.diag(np.square(np.array(sigmas)))


def noise_rates(gyro_noise: float, accel_noise: float, gyro_bias_noise: float, accel_bias_noise: float) -> Matrix:
    """Growth of the variances per second, shape (15,), from EKF2_GYR_NOISE, EKF2_ACC_NOISE and their biases'."""
    rates = np.zeros(STATES)
    rates[0:3] = gyro_noise**2 * EKF_STEP_S
    rates[3:6] = accel_noise**2 * EKF_STEP_S
    rates[9:12] = gyro_bias_noise**2 * EKF_STEP_S
    rates[12:15] = accel_bias_noise**2 * EKF_STEP_S
    return rates


def predict(
    covariance: Matrix, rotation: list[float], delta_velocity: Vector3, dt_s: float, noise: Matrix, transition: Matrix
) -> Matrix:
    """The covariance `dt_s` later.

    `rotation`: body to NED, 9 numbers by rows; `delta_velocity`: specific force integrated over the step, NED, m/s;
    `noise`: see `noise_rates`; `transition`: scratch (15, 15), an identity at first, overwritten.
    """
    r = np.array(rotation).reshape(3, 3)
    dvn, dve, dvd = delta_velocity
    transition[0:3, 9:12] = r * -dt_s
    transition[3:6, 12:15] = r * -dt_s
    transition[3, 1], transition[3, 2] = dvd, -dve
    transition[4, 0], transition[4, 2] = -dvd, dvn
    transition[5, 0], transition[5, 1] = dve, -dvn
    transition[6, 3] = transition[7, 4] = transition[8, 5] = dt_s
    predicted: Matrix = transition @ covariance @ transition.T
    predicted.flat[:: STATES + 1] += noise * dt_s
    return predicted


def fuse(covariance: Matrix, correction: Matrix, index: int, innovation: float, variance: float) -> None:
    """Fuse one direct observation of state `index`, in place.

    `innovation` is measured minus estimated before any `correction` (15,) of this batch, which is accounted for here
    and added to: the caller puts the batch's correction into its state at the end, and zeroes it.
    """
    row = covariance[index].copy()
    gain = row / (row[index] + variance)
    correction += gain * (innovation - correction[index])
    covariance -= np.outer(gain, row)


def symmetric(covariance: Matrix, floor: Matrix) -> Matrix:
    """The covariance freed of what rounding did: symmetric, its diagonal at least `floor` (15,)."""
    tidy: Matrix = (covariance + covariance.T) * 0.5
    diagonal = tidy.flat[:: STATES + 1]
    tidy.flat[:: STATES + 1] = np.maximum(diagonal, floor)
    return tidy


def forget(covariance: Matrix, first: int, count: int, variance: float) -> None:
    """Make `count` states from `first` unknown: no correlation, the variance as given. For resets."""
    covariance[first : first + count, :] = 0.0
    covariance[:, first : first + count] = 0.0
    for index in range(first, first + count):
        covariance[index, index] = variance
