"""What the autopilot keeps of plans: mission, fence and rally points (PX4's dataman).

Writers: mavlink/services/mission.py (uploads, clears) and the navigator (current item). Readers: both.
Opaque ids change with the content and are 0 for an empty plan (MISSION_COUNT.opaque_id).
"""

import struct
import zlib
from typing import NamedTuple

INVERTED_ZERO = 0xFFFFFFFF


class MissionItem(NamedTuple):
    """One MISSION_ITEM_INT as it was uploaded; `x` and `y` are 1e-7 deg in global frames."""

    seq: int
    frame: int
    command: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float

    @property
    def lat_deg(self) -> float:
        """Latitude of an item in a global frame."""
        return self.x * 1e-7

    @property
    def lon_deg(self) -> float:
        """Longitude of an item in a global frame."""
        return self.y * 1e-7


class Plan(NamedTuple):
    """The items of one MAV_MISSION_TYPE and their opaque id."""

    items: tuple[MissionItem, ...] = ()
    opaque_id: int = 0


def plan_of(items: tuple[MissionItem, ...]) -> Plan:
    """A plan with the id that its content gives: PX4's CRC-32 over its items (without inversion at start and end)."""
    crc = INVERTED_ZERO
    for item in items:
        position = (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)
        crc = zlib.crc32(struct.pack("<BHB4fiif", item.frame, item.command, item.autocontinue, *position), crc)
    return Plan(items, crc ^ INVERTED_ZERO)


class Dataman:
    """The three plans and the mission's current item."""

    def __init__(self) -> None:
        self.mission = Plan()
        self.fence = Plan()
        self.rally = Plan()
        self.current_seq = 0
