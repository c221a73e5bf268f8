"""The modes that AVAILABLE_MODES lists, in PX4 v1.18's order (https://mavlink.io/en/services/standard_modes.html)."""

from typing import NamedTuple

from sitl_emu.autopilot.commander.custom_mode import custom_mode_of
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES, Need
from sitl_emu.autopilot.vehicle_kind import Traits
from sitl_emu.core import dialect as mavlink

NON_STANDARD: int = mavlink.MAV_STANDARD_MODE_NON_STANDARD
ADVANCED: int = mavlink.MAV_MODE_PROPERTY_ADVANCED
NOT_USER_SELECTABLE: int = mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
LISTED = tuple(state for state, mode in FLIGHT_MODES.items() if mode.valid)


class Mode(NamedTuple):
    """One entry; a standard mode has no name of its own."""

    custom_mode: int
    properties: int
    standard_mode: int
    name: str


def listed(index: int, traits: Traits) -> Mode:
    """Mode `index`, counted from 1, as a kind of vehicle lists it."""
    state = LISTED[index - 1]
    mode, standard_mode = FLIGHT_MODES[state], standard_mode_of(state, traits)
    properties = (ADVANCED if mode.advanced else 0) | (0 if mode.selectable else NOT_USER_SELECTABLE)
    name = "(Mode not available)" if mode.needs & Need.OTHER else mode.name
    return Mode(custom_mode_of(state), properties, standard_mode, name if standard_mode == NON_STANDARD else "")


def standard_mode_of(nav_state: NavState, traits: Traits) -> int:
    """MAV_STANDARD_MODE of a mode; 0 where it is none."""
    return NON_STANDARD if nav_state in traits.no_standard_modes else FLIGHT_MODES[nav_state].standard_mode
