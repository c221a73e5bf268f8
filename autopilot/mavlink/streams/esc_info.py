"""ESC_INFO: the speed controllers, four in a message (PX4: streams/ESC_INFO.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.mavlink.streams.esc_status import PER_MESSAGE, TIMEOUT_US
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ESC_INFO
TEMPERATURE_CDEGC: Final = 5000
"""What SIH's speed controllers say (sih.cpp)."""


def fields(now_us: int, context: Context) -> list[Fields]:
    """The simulated ones never fail, and are all online while they are heard."""
    status = context.topics.esc_status
    count = len(status.rpm)
    heard = now_us - status.timestamp < TIMEOUT_US
    return [part(now_us, first, count, heard) for first in range(0, count, PER_MESSAGE)]


def part(now_us: int, first: int, count: int, heard: bool) -> Fields:
    """The message about ESC `first` and the three after it; of those that are not heard it says nothing."""
    there = min(PER_MESSAGE, count - first) if heard else 0
    temperatures = (TEMPERATURE_CDEGC,) * there + (0,) * (PER_MESSAGE - there)
    return (now_us, 0, 0, 0, 0, 0, 0, 0, 0, 0, *temperatures, first, count, 0, (1 << there) - 1)
