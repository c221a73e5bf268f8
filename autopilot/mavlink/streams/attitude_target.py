"""ATTITUDE_TARGET: what the attitude and rate controllers track (PX4: streams/ATTITUDE_TARGET.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET


def fields(now_us: int, context: Context) -> Fields | None:
    """Quaternion (w, x, y, z), rad/s; thrust is the magnitude, 0..1."""
    setpoint = context.topics.vehicle_attitude_setpoint
    if setpoint.timestamp == 0:
        return None
    w, x, y, z = setpoint.q_d
    p, q, r = context.topics.vehicle_rates_setpoint.rates
    return (setpoint.timestamp // 1000, w, x, y, z, p, q, r, math.hypot(*setpoint.thrust_body), 0)
