"""What a companion measures around and below the vehicle, for collision prevention and height above ground.

Sources: https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE and #DISTANCE_SENSOR. PX4 wants obstacles ten
times a second (CP_DIST), and takes a sensor that looks down for a height (EKF2_RNG_CTRL).
"""

import math
from collections.abc import Sequence

from sitl_emu.core import dialect as mavlink

PLACES = 72
UNKNOWN = 65535
FRAME_BODY_FRD = 12
LASER = 0
DOWNWARD = 25
"""MAV_SENSOR_ROTATION_PITCH_270."""


def obstacles(
    time_us: int,
    distances_m: Sequence[float | None],
    increment_deg: float,
    first_deg: float = 0.0,
    nearest_m: float = 0.2,
    farthest_m: float = 40.0,
) -> mavlink.MAVLink_message:
    """Distances clockwise from `first_deg` (0 is ahead), `increment_deg` apart; inf: nothing there, None: not known.

    Raises ValueError for more than PLACES of them.
    """
    if len(distances_m) > PLACES:
        raise ValueError(f"{len(distances_m)} distances; OBSTACLE_DISTANCE has {PLACES}: use a greater increment")
    values = [
        UNKNOWN if distance is None else round(min(distance, farthest_m + 0.01) * 100.0) for distance in distances_m
    ]
    values += [UNKNOWN] * (PLACES - len(values))
    limits = (round(nearest_m * 100.0), round(farthest_m * 100.0))
    return mavlink.MAVLink_obstacle_distance_message(
        time_us, LASER, values, round(increment_deg), *limits, increment_deg, first_deg, FRAME_BODY_FRD
    )


def distance(
    time_us: int, distance_m: float, nearest_m: float = 0.2, farthest_m: float = 40.0, orientation: int = DOWNWARD
) -> mavlink.MAVLink_message:
    """One distance; `orientation` is a MAV_SENSOR_ORIENTATION. Nothing there: infinity."""
    nearest, farthest = round(nearest_m * 100.0), round(farthest_m * 100.0)
    measured = farthest + 1 if math.isinf(distance_m) else round(distance_m * 100.0)
    return mavlink.MAVLink_distance_sensor_message(
        time_us // 1000, nearest, farthest, measured, LASER, 0, orientation, 255
    )
