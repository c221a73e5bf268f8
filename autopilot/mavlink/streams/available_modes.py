"""AVAILABLE_MODES: all modes, one message each (PX4: streams/AVAILABLE_MODES.hpp)."""

from autopilot.mavlink.available_modes import MODES, listed
from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES


def fields(now_us: int, context: Context) -> list[Fields]:
    """On request; all of them (REQUEST_MESSAGE's param2 0)."""
    return [one(index, context.is_rover) for index in range(1, len(MODES) + 1)]


def one(index: int, is_rover: bool) -> Fields:
    """Mode `index`, counted from 1."""
    mode = listed(index, is_rover)
    name = mode.name.encode()
    return (mode.custom_mode, mode.properties, len(MODES), index, mode.standard_mode, name)
