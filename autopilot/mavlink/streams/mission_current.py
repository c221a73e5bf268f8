"""MISSION_CURRENT: the current item, how many there are, and the plans' ids (PX4: mavlink_mission.cpp).

The item is what the ground has chosen, until the navigator tells of its mission (mission_result): whoever chooses
another item in HOLD and takes off then hears of the one before again, until the mission goes on at the chosen one. Of
a plan without a marked item it is none (65535) until the navigator has looked at it, for which it waits for home.
"""

from typing import Final

from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_MISSION_CURRENT
NO_MISSION_TOTAL: Final = 65535
MODE_ACTIVE: Final = 1
MODE_SUSPENDED: Final = 2


def fields(now_us: int, context: Context) -> Fields:
    """Total is 65535 without a mission; MISSION_MODE 1 is active, 2 suspended."""
    dataman = context.dataman
    result = context.topics.mission_result
    total = len(dataman.mission.items)
    active = FLIGHT_MODES[context.topics.vehicle_status.nav_state].mission_is_active
    return (
        dataman.told_seq & 0xFFFF if total else 0,
        total or NO_MISSION_TOTAL,
        result.mission_state or mavlink.MISSION_STATE_NO_MISSION,
        MODE_ACTIVE if active else MODE_SUSPENDED,
        dataman.mission.opaque_id,
        dataman.fence.opaque_id,
        dataman.rally.opaque_id,
    )
