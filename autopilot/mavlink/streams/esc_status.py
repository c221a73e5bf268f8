"""ESC_STATUS: speed, voltage and current of the motors, four in a message (PX4: streams/ESC_STATUS.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ESC_STATUS
PER_MESSAGE: Final = 4
TIMEOUT_US: Final = 100_000
NOT_MEASURED: Final = (0.0,) * PER_MESSAGE
"""Voltage and current: SIH's speed controllers tell neither (sih.cpp)."""


def fields(now_us: int, context: Context) -> list[Fields]:
    """Nothing while no speed controller was heard; 0 from one that has fallen silent."""
    status = context.topics.esc_status
    rpm = status.rpm if now_us - status.timestamp < TIMEOUT_US else (0,) * len(status.rpm)
    return [part(now_us, first, rpm[first : first + PER_MESSAGE]) for first in range(0, len(rpm), PER_MESSAGE)]


def part(now_us: int, first: int, rpm: tuple[int, ...]) -> Fields:
    """The message about motor `first` and the three after it."""
    absent = (0,) * (PER_MESSAGE - len(rpm))
    return (now_us, *rpm, *absent, *NOT_MEASURED, *NOT_MEASURED, first)
