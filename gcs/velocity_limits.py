"""SET_VELOCITY_LIMITS: how fast the mode POSITION_SLOW may fly, as a camera operator's station tells it.

Source: https://mavlink.io/en/messages/development.html#SET_VELOCITY_LIMITS. PX4 keeps the last one.
"""

import math

from sitl_emu.core import dialect as mavlink


def velocity_limits(
    system: int, horizontal_m_s: float = math.nan, vertical_m_s: float = math.nan, yaw_rate_deg_s: float = math.nan
) -> mavlink.MAVLink_message:
    """NaN leaves a limit to the vehicle."""
    return mavlink.MAVLink_set_velocity_limits_message(
        horizontal_m_s, vertical_m_s, math.radians(yaw_rate_deg_s), system, 0
    )
