"""ODOMETRY: pose in NED and velocity in the body frame (PX4: streams/ODOMETRY.hpp)."""

import math

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ODOMETRY
AUTOPILOT = 8
"""MAV_ESTIMATOR_TYPE_AUTOPILOT."""
ATTITUDE_VARIANCE = 1e-4
"""rad²; the filter does not tell the variance of its attitude."""
ATTITUDE_DIAGONAL = (ATTITUDE_VARIANCE, 0.0, 0.0, ATTITUDE_VARIANCE, 0.0, ATTITUDE_VARIANCE)
RATES_DIAGONAL = (math.nan, 0.0, 0.0, math.nan, 0.0, math.nan)


def fields(now_us: int, context: Context) -> Fields | None:
    """Covariances (upper triangles of 6 x 6) carry the diagonal alone, as PX4's do."""
    topics = context.topics
    local = topics.vehicle_local_position
    if local.timestamp == 0:
        return None
    w, x, y, z = topics.vehicle_attitude.q
    p, q, r = topics.vehicle_angular_velocity.xyz
    vn, ve, vd = local.vx, local.vy, local.vz
    vx = (1.0 - 2.0 * (y * y + z * z)) * vn + 2.0 * (x * y + w * z) * ve + 2.0 * (x * z - w * y) * vd
    vy = 2.0 * (x * y - w * z) * vn + (1.0 - 2.0 * (x * x + z * z)) * ve + 2.0 * (y * z + w * x) * vd
    vz = 2.0 * (x * z + w * y) * vn + 2.0 * (y * z - w * x) * ve + (1.0 - 2.0 * (x * x + y * y)) * vd
    position = (*diagonal(0.5 * local.eph * local.eph, local.epv * local.epv), *ATTITUDE_DIAGONAL)
    velocity = (*diagonal(0.5 * local.evh * local.evh, local.evv * local.evv), *RATES_DIAGONAL)
    resets = (local.xy_reset_counter + local.z_reset_counter) & 255
    return (
        now_us,
        local.x,
        local.y,
        local.z,
        w,
        x,
        y,
        z,
        vx,
        vy,
        vz,
        p,
        q,
        r,
        *position,
        *velocity,
        mavlink.MAV_FRAME_LOCAL_NED,
        mavlink.MAV_FRAME_BODY_FRD,
        resets,
        AUTOPILOT,
        0,
    )


def diagonal(horizontal: float, vertical: float) -> Fields:
    """The first three rows' upper triangle of a diagonal 6 x 6 matrix: 15 numbers."""
    return (horizontal, 0.0, 0.0, 0.0, 0.0, 0.0, horizontal, 0.0, 0.0, 0.0, 0.0, vertical, 0.0, 0.0, 0.0)
