"""Which of a command's seven parameters PX4 v1.18 uses (mavlink_command_params.hpp), in a plan and as a command.

A parameter that is not used must be 0 or not given (NaN); what sets it is refused before anybody else looks at it. A
command that is in no table may set all.
"""

import math
from collections.abc import Sequence

from autopilot.vehicle_kind import Traits
from sitl_emu.core import dialect as mavlink

P1, P2, P3, P4, P5, P6, P7 = (1 << number for number in range(7))
P12, P123, P1234, PLACE = P1 | P2, P1 | P2 | P3, P1 | P2 | P3 | P4, P5 | P6 | P7
ALL = P1234 | PLACE

IN_PLANS = {
    16: P12 | P4 | PLACE,
    17: P3 | P4 | PLACE,
    19: P1234 | PLACE,
    20: 0,
    21: P12 | P4 | PLACE,
    22: P1 | P4 | PLACE,
    31: P12 | P4 | PLACE,
    80: P123 | PLACE,
    84: P4 | PLACE,
    85: P4 | PLACE,
    93: P1234,
    112: P1,
    114: P1,
    176: P123,
    177: P12,
    178: P123,
    179: P1234 | PLACE,
    189: PLACE,
    195: PLACE,
    196: P1,
    197: P1,
    201: P123,
    206: P1234,
    211: P12,
    212: P12,
    214: P123,
    400: P12,
    420: P123,
    530: P12,
    532: P123,
    534: P123,
    611: 0,
    2000: P1234,
    2001: P1,
    2003: P1234,
    2500: P123,
    2501: P12,
    3000: P12,
    4501: 0,
    5000: PLACE,
    5001: P1 | P5 | P6,
    5002: P1 | P5 | P6,
    5003: P1 | P5 | P6,
    5004: P1 | P5 | P6,
    5100: PLACE,
    42600: P1234,
}
"""Of a mission, fence or rally item."""
IN_COMMANDS = IN_PLANS | {
    84: P3 | P4 | PLACE,
    85: ALL,
    195: P1 | PLACE,
    611: PLACE,
    5000: 0,
    **dict.fromkeys((5001, 5002, 5003, 5004), P1),
    5100: 0,
}
"""Of a COMMAND_LONG or COMMAND_INT."""
TAKEOFF_WITHOUT_PITCH = P4 | PLACE
"""NAV_TAKEOFF of kinds that have no use for a pitch (Traits.takeoff_has_pitch)."""


def used_params(command: int, table: dict[int, int], traits: Traits) -> int:
    """A bit for each parameter that may be set, of param1 in the lowest."""
    if command == mavlink.MAV_CMD_NAV_TAKEOFF and not traits.takeoff_has_pitch:
        return TAKEOFF_WITHOUT_PITCH
    return table.get(command, ALL)


def sets_unused(used: int, values: Sequence[float]) -> bool:
    """Whether one of the seven numbers is set and not used."""
    return any(not (used >> place & 1 or value == 0.0 or math.isnan(value)) for place, value in enumerate(values))
