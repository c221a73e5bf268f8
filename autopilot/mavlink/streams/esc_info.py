"""ESC_INFO: the speed controllers, four in a message (PX4: streams/ESC_INFO.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_ESC_INFO
CONNECTION_DSHOT = 5
UNKNOWN_TEMPERATURE = 32767
COLD_CDEGC, WARMER_CDEGC = 2000, 4000
"""Temperature at rest, and what full output adds (PX4's simulator_mavlink)."""


def fields(now_us: int, context: Context) -> list[Fields]:
    """The simulated ones never fail and are all online while there are outputs; none on a rover."""
    outputs = context.topics.actuator_outputs
    if context.is_rover or outputs.timestamp == 0:
        return []
    count = context.motor_count
    temperatures = [COLD_CDEGC + truncated(WARMER_CDEGC * abs(control)) for control in outputs.controls[:count]]
    return [part(now_us, first, count, temperatures) for first in range(0, count, 4)]


def part(now_us: int, first: int, count: int, temperatures: list[int]) -> Fields:
    """The message about ESC `first` and the three after it."""
    sample = now_us // 1000 & 0xFFFF
    there = temperatures[first : first + 4]
    there += [UNKNOWN_TEMPERATURE] * (4 - len(there))
    return (now_us, 0, 0, 0, 0, sample, 0, 0, 0, 0, *there, first, count, CONNECTION_DSHOT, (1 << count) - 1)
