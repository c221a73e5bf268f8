"""How the ground moves under a camera that looks down.

Source: https://mavlink.io/en/messages/common.html#OPTICAL_FLOW_RAD. PX4 fuses it where EKF2_OF_CTRL says so, with the
height of a range sensor.
"""

import math

from sitl_emu.core import dialect as mavlink

TEMPERATURE_UNKNOWN = 0


def optical_flow(
    time_us: int,
    integration_us: int,
    flow_rad: tuple[float, float],
    gyro_rad: tuple[float, float, float] = (math.nan, math.nan, math.nan),
    quality: int = 255,
    distance_m: float = -1.0,
) -> mavlink.MAVLink_message:
    """Angles by which the picture turned about the sensor's x (forward) and y (right) within `integration_us`.

    `gyro_rad`: by how much the sensor itself turned, NaN if it does not know; `distance_m` to the ground, negative if
    unknown; `quality` 0..255.
    """
    return mavlink.MAVLink_optical_flow_rad_message(
        time_us, 0, integration_us, *flow_rad, *gyro_rad, TEMPERATURE_UNKNOWN, quality, 0, distance_m
    )
