"""AUTOPILOT_STATE_FOR_GIMBAL_DEVICE: attitude and motion for a gimbal (PX4's stream of that name)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields, estimator_status, extended_sys_state
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_AUTOPILOT_STATE_FOR_GIMBAL_DEVICE


def fields(now_us: int, context: Context) -> Fields:
    """Broadcast (targets 0); delays are 0 in simulation."""
    topics = context.topics
    local = topics.vehicle_local_position
    estimator = estimator_status.fields(now_us, context)
    flags = estimator[-1] if estimator is not None else 0
    landed_state = extended_sys_state.fields(now_us, context)[1]
    yaw_rate = topics.vehicle_angular_velocity.xyz[2]
    feed_forward = topics.vehicle_rates_setpoint.rates[2]
    motion = (local.vx, local.vy, local.vz)
    return (now_us, *topics.vehicle_attitude.q, 0, *motion, 0, feed_forward, flags, 0, 0, landed_state, yaw_rate)
