"""GLOBAL_POSITION_SENSOR: where other sources see the vehicle, told again (PX4: streams/GLOBAL_POSITION_SENSOR.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields, new_ones
from sitl_emu.autopilot.topics import AuxGlobalPosition
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_SENSOR
SOURCES: Final = 4
"""Length of the MultiArray that PX4's stream listens to."""


def since(context: Context, told: tuple[int, ...] | int) -> tuple[tuple[int, ...], list[Fields]]:
    """Of each source what it has said since then."""
    sources = context.topics.aux_global_position[:SOURCES]
    stamps = tuple(source.timestamp for source in sources)
    return stamps, [_message(sources[number]) for number in new_ones(stamps, told)]


def fields(now_us: int, context: Context) -> Fields | None:
    """Sources are told as they speak."""
    return None


def _message(told: AuxGlobalPosition) -> Fields:
    """1e-7 deg; both altitudes are the one above the sea. Broadcast (targets 0)."""
    place = (truncated(told.lat * 1e7), truncated(told.lon * 1e7), told.alt, told.alt, told.eph, told.epv)
    return (told.timestamp, 0, *place, 0, 0, told.id, told.source, 0)
