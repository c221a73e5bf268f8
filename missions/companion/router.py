"""Who gets a message on a companion with two links: the companion itself, the other link, both or nobody.

MAVLink's routing by target system and component (https://mavlink.io/en/guide/routing.html), as narrow as the job
allows: a peer may hand our autopilot a mission, and nothing else of it. Commands of a peer to our autopilot are not
passed on: who arms a vehicle is its own companion or its pilot. Answers of our autopilot go back to the peer that
asked. Broadcasts are heard, and stay on their side (`peer_link.py` sends what a peer should know of us).
"""

from collections.abc import Collection
from typing import NamedTuple

from missions.companion.companion import AUTOPILOT_LINK, COMPONENT_ID, PEER_LINK
from sitl_emu.core import dialect as mavlink

AUTOPILOT_COMPONENT = 1
MISSION_PROTOCOL = frozenset(
    {
        "MISSION_COUNT",
        "MISSION_REQUEST",
        "MISSION_REQUEST_INT",
        "MISSION_REQUEST_LIST",
        "MISSION_ITEM",
        "MISSION_ITEM_INT",
        "MISSION_ACK",
        "MISSION_CLEAR_ALL",
    }
)


class Route(NamedTuple):
    """`mine`: the companion hears it. `forward`: the link it goes out on again, or None."""

    mine: bool
    forward: str | None


def route(link: str, msg: mavlink.MAVLink_message, system: int, peers: Collection[int]) -> Route:
    """The way of a message that came in on `link`. `system`: ours; `peers`: systems heard on the peer link."""
    target_system: int = getattr(msg, "target_system", 0)
    target_component: int = getattr(msg, "target_component", 0)
    if target_system in (0, system):
        if link == PEER_LINK and target_system == system and target_component == AUTOPILOT_COMPONENT:
            return Route(False, AUTOPILOT_LINK if msg.get_type() in MISSION_PROTOCOL else None)
        return Route(target_component in (0, COMPONENT_ID) or target_system == 0, None)
    if link == AUTOPILOT_LINK and target_system in peers:
        return Route(False, PEER_LINK)
    return Route(False, None)
