"""GLOBAL_POSITION_SENSOR: where other sources see the vehicle, told again (PX4: streams/GLOBAL_POSITION_SENSOR.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.topics import AuxGlobalPosition
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_SENSOR
SILENT_US: Final = 1_000_000
"""A source that has said nothing for so long is not told any more."""


def stamp(now_us: int, context: Context) -> int:
    """Once per place, whose ever."""
    return max((told.timestamp for told in context.topics.aux_global_position), default=0)


def fields(now_us: int, context: Context) -> list[Fields]:
    """One message a source."""
    sources = context.topics.aux_global_position
    return [_message(told) for told in sources if now_us - told.timestamp < SILENT_US]


def _message(told: AuxGlobalPosition) -> Fields:
    """1e-7 deg; both altitudes are the one above the sea. Broadcast (targets 0)."""
    place = (truncated(told.lat * 1e7), truncated(told.lon * 1e7), told.alt, told.alt, told.eph, told.epv)
    return (told.timestamp, 0, *place, 0, 0, told.id, told.source, 0)
