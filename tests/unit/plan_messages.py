"""Messages of plans, as a ground station sends them."""

from typing import Any

from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import Peer, names, only

GLOBAL, MISSION_FRAME, RELATIVE, RELATIVE_INT = 0, 2, 3, 6
"""Frames: MAV_FRAME_GLOBAL, _MISSION, _GLOBAL_RELATIVE_ALT, _GLOBAL_RELATIVE_ALT_INT."""
HOME_X, HOME_Y = 473977418, 85455939
"""Latitude and longitude of the default home, 1e-7 degrees."""


def item(seq: int, command: int = 16, frame: int = RELATIVE_INT, **fields: Any) -> Any:
    values: dict[str, Any] = dict.fromkeys(("param1", "param2", "param3", "param4"), 0.0)
    values |= {"x": HOME_X, "y": HOME_Y, "z": 10.0, "mission_type": 0, "current": 0, "autocontinue": 1} | fields
    return mavlink.MAVLink_mission_item_int_message(
        target_system=1, target_component=1, seq=seq, frame=frame, command=command, **values
    )


def count(number: int, kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_count_message(1, 1, number, kind)


def upload(peer: Peer, *items: Any, kind: int = 0) -> tuple[int, int]:
    """Upload and return MISSION_ACK's type and mission type."""
    replies = peer.send(count(len(items), kind))
    for each in items:
        assert names(replies) == ["MISSION_REQUEST_INT"], replies
        assert replies[0].seq == each.seq
        replies = peer.send(each)
        if only(replies, "MISSION_ACK"):
            break
    ack = only(replies, "MISSION_ACK")[0]
    return ack.type, ack.mission_type
