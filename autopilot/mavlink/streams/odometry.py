"""ODOMETRY: pose and velocity in NED, rates about the body's axes (PX4: ODOMETRY.hpp, EKF2::PublishOdometry)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import variances_about_body

ID = mavlink.MAVLINK_MSG_ID_ODOMETRY
AUTOPILOT: Final = 8
"""MAV_ESTIMATOR_TYPE_AUTOPILOT."""
RATES: Final = (0.0, 0.0, 0.0)
"""Their variances are not told."""


def stamp(now_us: int, context: Context) -> int:
    """Each message has a new estimate."""
    return context.topics.vehicle_local_position.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Covariances (upper triangles of 6 x 6) carry the filter's diagonal alone, 0 elsewhere and for the rates."""
    topics = context.topics
    local = topics.vehicle_local_position
    if local.timestamp == 0:
        return None
    attitude = topics.vehicle_attitude
    w, x, y, z = attitude.q
    p, q, r = topics.vehicle_angular_velocity.xyz
    variances = topics.odometry_variances
    position = diagonal((*variances.position, *variances_about_body(attitude.q, variances.attitude)))
    velocity = diagonal((*variances.velocity, *RATES))
    resets = local.xy_reset_counter + local.z_reset_counter + local.vxy_reset_counter + local.vz_reset_counter
    return (
        local.timestamp_sample,
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
        (resets + attitude.quat_reset_counter) & 255,
        AUTOPILOT,
        0,
    )


def diagonal(variances: tuple[float, ...]) -> Fields:
    """The upper triangle of a 6 x 6 matrix with nothing beside the diagonal, by rows: 21 numbers."""
    return tuple(
        number for row, variance in enumerate(variances) for number in (variance, *(0.0,) * (len(variances) - 1 - row))
    )
