"""OPTICAL_FLOW_RAD: the flow that the estimator is given (PX4: streams/OPTICAL_FLOW_RAD.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_OPTICAL_FLOW_RAD
UNKNOWN_DISTANCE: Final = -1.0


def stamp(now_us: int, context: Context) -> int:
    """Once per measurement."""
    return context.topics.vehicle_optical_flow.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """rad, m (-1: no distance is known); nothing before a sensor has spoken.

    Who measured, when the distance was, and how warm it is, is 0.
    """
    flow = context.topics.vehicle_optical_flow
    if not flow.timestamp:
        return None
    angles = (*flow.pixel_flow, *flow.delta_angle)
    distance_m = flow.distance_m if math.isfinite(flow.distance_m) else UNKNOWN_DISTANCE
    return (flow.timestamp, flow.integration_timespan_us, *angles, 0, distance_m, 0, 0, flow.quality)
