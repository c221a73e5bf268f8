"""HIL_ACTUATOR_CONTROLS: what the simulator is sent (PX4: streams/HIL_ACTUATOR_CONTROLS.hpp)."""

from typing import Final

from sitl_emu.autopilot.commander.custom_mode import FLAG_GUIDED_ENABLED
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields, heartbeat, servo_output_raw
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_HIL_ACTUATOR_CONTROLS
CHANNELS: Final = 16
stamp = servo_output_raw.stamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Motors 0..1, servos -1..1; the mode is the HEARTBEAT's base mode, but guided in a mission alone."""
    outputs = context.actuator_outputs()
    if outputs is None:
        return None
    controls = outputs.controls[:CHANNELS]
    padding = (0.0,) * (CHANNELS - len(controls))
    mode = heartbeat.fields(now_us, context)[3]
    if context.topics.vehicle_status.nav_state != NavState.AUTO_MISSION:
        mode &= ~FLAG_GUIDED_ENABLED
    return (outputs.timestamp, 0, *controls, *padding, mode)
