"""ACTUATOR_OUTPUT_STATUS: raw outputs (PX4: streams/ACTUATOR_OUTPUT_STATUS.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS


def fields(now_us: int, context: Context) -> Fields | None:
    """Outputs that have a function, padded to 32. PX4's simulated rover has nothing to say here."""
    outputs = context.topics.actuator_outputs
    if context.is_rover:
        return None
    controls = outputs.controls[:32]
    active = (1 << len(controls)) - 1
    return (outputs.timestamp, active, *controls, *(0.0,) * (32 - len(controls)))
