"""AUTOPILOT_STATE_FOR_GIMBAL_DEVICE: attitude and motion for a gimbal (PX4's stream of that name)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields, estimator_status
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_AUTOPILOT_STATE_FOR_GIMBAL_DEVICE


def stamp(now_us: int, context: Context) -> int:
    """Every sample of the gyro brings an attitude (EKF2::PublishAttitude)."""
    return context.topics.vehicle_angular_velocity.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Broadcast (targets 0); delays and the rate about z are not told (0), nor take-off and landing."""
    topics = context.topics
    if not topics.vehicle_attitude.timestamp:
        return None
    local = topics.vehicle_local_position
    estimator = estimator_status.fields(now_us, context)
    flags = estimator[-1] if estimator is not None else 0
    landed = topics.vehicle_land_detected.landed
    landed_state = mavlink.MAV_LANDED_STATE_ON_GROUND if landed else mavlink.MAV_LANDED_STATE_IN_AIR
    attitude, motion = topics.vehicle_attitude, (local.vx, local.vy, local.vz)
    feed_forward = topics.vehicle_attitude_setpoint.yaw_sp_move_rate
    return (attitude.timestamp, *attitude.q, 0, *motion, 0, feed_forward, flags, 0, 0, landed_state, 0.0)
