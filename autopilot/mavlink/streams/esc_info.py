"""ESC_INFO: the speed controllers, four in a message (PX4: streams/ESC_INFO.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ESC_INFO
CONNECTION_DRONECAN = 5
UNKNOWN_TEMPERATURE = 32767


def fields(now_us: int, context: Context) -> list[Fields]:
    """The simulated ones never fail and are all online while there are outputs; none on a rover."""
    if context.is_rover or context.topics.actuator_outputs.timestamp == 0:
        return []
    count = context.motor_count
    online = (1 << count) - 1
    return [part(now_us, first, count, online) for first in range(0, count, 4)]


def part(now_us: int, first: int, count: int, online: int) -> Fields:
    """The message about ESC `first` and the three after it."""
    sample = now_us // 1000 & 0xFFFF
    temperatures = tuple(0 if first + i < count else UNKNOWN_TEMPERATURE for i in range(4))
    return (now_us, 0, 0, 0, 0, sample, 0, 0, 0, 0, *temperatures, first, count, CONNECTION_DRONECAN, online)
