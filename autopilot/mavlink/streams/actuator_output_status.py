"""ACTUATOR_OUTPUT_STATUS: the outputs as SERVO_OUTPUT_RAW shows them (PX4: streams/ACTUATOR_OUTPUT_STATUS.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS
OUTPUTS: Final = 16
PLACES: Final = 32


def fields(now_us: int, context: Context) -> Fields | None:
    """Pulses in µs, 0 for an output without function. PX4 says how many there are where the message means a mask."""
    outputs = context.actuator_outputs()
    if outputs is None:
        return None
    pulses = tuple(map(float, outputs.pwm[:OUTPUTS]))
    return (outputs.timestamp, OUTPUTS, *pulses, *(0.0,) * (PLACES - len(pulses)))
