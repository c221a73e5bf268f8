"""ODOMETRY: pose and velocity in NED, rates about the body's axes (PX4: streams/ODOMETRY.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ODOMETRY
AUTOPILOT: Final = 8
"""MAV_ESTIMATOR_TYPE_AUTOPILOT."""
ATTITUDE_VARIANCE: Final = 1e-4
"""rad²; the filter does not tell the variance of its attitude."""
NAN = math.nan
ATTITUDE_DIAGONAL = (ATTITUDE_VARIANCE, NAN, NAN, ATTITUDE_VARIANCE, NAN, ATTITUDE_VARIANCE)
RATES_DIAGONAL: Final = (NAN,) * 6


def fields(now_us: int, context: Context) -> Fields | None:
    """Covariances (upper triangles of 6 x 6) carry the diagonal alone, NaN elsewhere and for the rates."""
    topics = context.topics
    local = topics.vehicle_local_position
    if local.timestamp == 0:
        return None
    w, x, y, z = topics.vehicle_attitude.q
    p, q, r = topics.vehicle_angular_velocity.xyz
    position = (*diagonal(0.5 * local.eph * local.eph, local.epv * local.epv), *ATTITUDE_DIAGONAL)
    velocity = (*diagonal(0.5 * local.evh * local.evh, local.evv * local.evv), *RATES_DIAGONAL)
    resets = (local.xy_reset_counter + local.z_reset_counter) & 255
    return (
        local.timestamp,
        local.x,
        local.y,
        local.z,
        w,
        x,
        y,
        z,
        local.vx,
        local.vy,
        local.vz,
        p,
        q,
        r,
        *position,
        *velocity,
        mavlink.MAV_FRAME_LOCAL_NED,
        mavlink.MAV_FRAME_LOCAL_NED,
        resets,
        AUTOPILOT,
        0,
    )


def diagonal(horizontal: float, vertical: float) -> Fields:
    """The first three rows' upper triangle of a 6 x 6 matrix with nothing known beside the diagonal: 15 numbers."""
    return (horizontal, *(NAN,) * 5, horizontal, *(NAN,) * 4, vertical, *(NAN,) * 3)
