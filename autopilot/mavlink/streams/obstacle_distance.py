"""OBSTACLE_DISTANCE: what collision prevention knows around the vehicle (PX4: streams/OBSTACLE_DISTANCE.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_OBSTACLE_DISTANCE
LASER: Final = 0


def stamp(now_us: int, context: Context) -> int:
    """Once per map."""
    return context.topics.obstacle_distance_fused.told_us


def fields(now_us: int, context: Context) -> Fields | None:
    """cm, 65535 unknown, in 72 directions of the body; nothing while collision prevention is not at work."""
    known = context.topics.obstacle_distance_fused
    if not known.told_us:
        return None
    limits = (known.min_distance, known.max_distance)
    angles = (known.increment, known.angle_offset, known.frame)
    return (known.timestamp, *known.distances, *limits, LASER, 0, *angles)
