"""AVAILABLE_MODES: all modes, one message each (PX4: streams/AVAILABLE_MODES.hpp)."""

import math

from sitl_emu.autopilot.mavlink.available_modes import LISTED, listed
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.vehicle_kind import Traits
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES


def fields(now_us: int, context: Context) -> None:
    """On request only."""


def requested(now_us: int, context: Context, param2: float) -> list[Fields] | None:
    """Mode `param2`, all for 0; as from PX4, a negative one is accepted and nothing comes."""
    index = math.floor(param2 + 0.5) if math.isfinite(param2) else -1
    if index > len(LISTED):
        return None
    wanted = range(1, len(LISTED) + 1) if index == 0 else range(index, index + 1)
    return [one(each, context.traits) for each in wanted if each > 0]


def one(index: int, traits: Traits) -> Fields:
    """Mode `index`, counted from 1."""
    mode = listed(index, traits)
    name = mode.name.encode()
    return (mode.custom_mode, mode.properties, len(LISTED), index, mode.standard_mode, name)
