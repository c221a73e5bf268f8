"""OPTICAL_FLOW_RAD: the flow that the estimator is given (PX4: streams/OPTICAL_FLOW_RAD.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_OPTICAL_FLOW_RAD


def stamp(now_us: int, context: Context) -> int:
    """Once per measurement."""
    return context.topics.vehicle_optical_flow.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """rad, m; nothing before a sensor has spoken. Who measured, when the distance was, and how warm it is, is 0."""
    flow = context.topics.vehicle_optical_flow
    if not flow.timestamp:
        return None
    angles = (*flow.pixel_flow, *flow.delta_angle)
    return (flow.timestamp, flow.integration_timespan_us, *angles, 0, flow.distance_m, 0, 0, flow.quality)
