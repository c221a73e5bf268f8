"""HIL_ACTUATOR_CONTROLS: what the simulator is sent (PX4: streams/HIL_ACTUATOR_CONTROLS.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_HIL_ACTUATOR_CONTROLS
CHANNELS = 16
ARMED = 128


def fields(now_us: int, context: Context) -> Fields | None:
    """Motors 0..1, servos -1..1. PX4's simulated rover has nothing to say here."""
    outputs = context.topics.actuator_outputs
    if context.is_rover:
        return None
    controls = outputs.controls[:CHANNELS]
    padding = (0.0,) * (CHANNELS - len(controls))
    mode = ARMED if context.topics.actuator_armed.armed else 0
    return (now_us, 0, *controls, *padding, mode)
