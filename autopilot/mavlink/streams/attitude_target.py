"""ATTITUDE_TARGET: what the attitude and rate controllers track (PX4: streams/ATTITUDE_TARGET.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET
NO_ATTITUDE_US: Final = 500_000
"""Without a new attitude for so long, it is told of each setpoint of rates."""


def stamp(now_us: int, context: Context) -> int:
    """Once per setpoint of attitude, or of rates where those alone are controlled."""
    attitude_us = context.topics.vehicle_attitude_setpoint.timestamp
    rates_us = context.topics.vehicle_rates_setpoint.timestamp if now_us - attitude_us > NO_ATTITUDE_US else 0
    return max(attitude_us, rates_us)


def fields(now_us: int, context: Context) -> Fields | None:
    """Quaternion (w, x, y, z; all 0 where rates alone were ever controlled), rad/s; thrust is the magnitude, 0..1."""
    setpoint, rates = context.topics.vehicle_attitude_setpoint, context.topics.vehicle_rates_setpoint
    if not setpoint.timestamp and not rates.timestamp:
        return None
    w, x, y, z = setpoint.q_d if setpoint.timestamp else (0.0, 0.0, 0.0, 0.0)
    p, q, r = rates.rates
    return (setpoint.timestamp // 1000, w, x, y, z, p, q, r, math.hypot(*setpoint.thrust_body), 0)
