"""Poses from outside: what visual odometry or motion capture knows of the vehicle.

Sources: https://mavlink.io/en/messages/common.html#ODOMETRY and
https://docs.px4.io/v1.18/en/ros/external_position_estimation.html. PX4 fuses what EKF2_EV_CTRL allows, delayed by
EKF2_EV_DELAY; it wants 30 to 50 of them a second.
"""

import math

from sitl_emu.core import dialect as mavlink

FRAME_LOCAL_NED, FRAME_LOCAL_FRD, FRAME_BODY_FRD = 1, 20, 12
"""Pose against north, or against a frame whose heading is not known; velocities along the body's axes."""
VISION = 2
"""MAV_ESTIMATOR_TYPE."""
UPPER_DIAGONAL = (0, 6, 11, 15, 18, 20)
"""Places of the variances in the upper half of a 6 x 6 matrix, by rows."""
COVARIANCES = 21
UNKNOWN3 = (math.nan, math.nan, math.nan)
UNKNOWN_Q = (math.nan, math.nan, math.nan, math.nan)

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def odometry(
    time_us: int,
    position_m: Vector3 = UNKNOWN3,
    q: Quaternion = UNKNOWN_Q,
    velocity_m_s: Vector3 = UNKNOWN3,
    *,
    position_variance: Vector3 = UNKNOWN3,
    orientation_variance: Vector3 = UNKNOWN3,
    velocity_variance: Vector3 = UNKNOWN3,
    frame: int = FRAME_LOCAL_NED,
    reset_counter: int = 0,
) -> mavlink.MAVLink_message:
    """ODOMETRY: pose in `frame`, `q` from FRD to it (w first), velocity in body FRD; NaN is not known.

    `reset_counter` goes up each time the estimate jumps.
    """
    return mavlink.MAVLink_odometry_message(
        time_us,
        frame,
        FRAME_BODY_FRD,
        *position_m,
        q,
        *velocity_m_s,
        *UNKNOWN3,
        _covariance((*position_variance, *orientation_variance)),
        _covariance((*velocity_variance, *UNKNOWN3)),
        reset_counter & 0xFF,
        VISION,
    )


def vision_position(
    time_us: int, position_m: Vector3, roll_rad: float, pitch_rad: float, yaw_rad: float, reset_counter: int = 0
) -> mavlink.MAVLink_message:
    """VISION_POSITION_ESTIMATE: a pose in NED, without variances."""
    covariance = _covariance((*UNKNOWN3, *UNKNOWN3))
    return mavlink.MAVLink_vision_position_estimate_message(
        time_us, *position_m, roll_rad, pitch_rad, yaw_rad, covariance, reset_counter & 0xFF
    )


def _covariance(variances: tuple[float, ...]) -> list[float]:
    """A matrix that has these on its diagonal; MAVLink says by a NaN in front that none is known."""
    if all(math.isnan(variance) for variance in variances):
        return [math.nan] + [0.0] * (COVARIANCES - 1)
    half = [0.0] * COVARIANCES
    for place, variance in zip(UPPER_DIAGONAL, variances, strict=True):
        half[place] = variance
    return half
