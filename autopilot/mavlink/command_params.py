"""Which of a command's seven parameters PX4 v1.18 uses (mavlink_command_params.hpp), in a plan and as a command.

A parameter that is not used must be 0 or not given (NaN); what sets it is refused before anybody else looks at it.
"""

import math
from collections.abc import Sequence

from sitl_emu.autopilot.commands.table import COMMANDS, P4, PLACE, UNKNOWN
from sitl_emu.autopilot.vehicle_kind import Traits
from sitl_emu.core import dialect as mavlink

TAKEOFF_WITHOUT_PITCH = P4 | PLACE
"""NAV_TAKEOFF of kinds that have no use for a pitch (Traits.takeoff_has_pitch)."""


def used_params(number: int, traits: Traits, *, in_plan: bool) -> int:
    """A bit for each parameter that may be set, of param1 in the lowest; all for a command that nobody knows."""
    if number == mavlink.MAV_CMD_NAV_TAKEOFF and not traits.takeoff_has_pitch:
        return TAKEOFF_WITHOUT_PITCH
    command = COMMANDS.get(number, UNKNOWN)
    return command.in_plan if in_plan and command.in_plan is not None else command.params


def sets_unused(used: int, values: Sequence[float]) -> bool:
    """Whether one of the seven numbers is set and not used."""
    return any(not (used >> place & 1 or value == 0.0 or math.isnan(value)) for place, value in enumerate(values))
