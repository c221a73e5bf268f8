"""The mission protocol's serving half on a companion: takes the missions that peers upload to it.

Source: https://mavlink.io/en/services/mission.html, with PX4 v1.18's times as measured (mission/silent_upload/*;
`gcs/mission.py` is the client half): we ask for every item, again after 0.25 s, and give up 5 s after the last answer;
a last item that comes once more is acknowledged once more, for our acknowledgement was lost. Several peers may upload
at the same time, each has its own transfer. A mission is offered to `accept`, which answers with a MAV_MISSION_RESULT,
and is taken when that is "accepted". Missions are kept by whoever owns the server; downloads, fences and rally points
are not served.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.mission import ACCEPTED, MISSION, MissionItem

REQUEST_AGAIN_US = 250_000
GIVE_UP_US = 5_000_000
MOST_ITEMS = 20
ERROR: int = mavlink.MAV_MISSION_ERROR
UNSUPPORTED: int = mavlink.MAV_MISSION_UNSUPPORTED
NO_SPACE: int = mavlink.MAV_MISSION_NO_SPACE

Sender = tuple[int, int]
"""System and component."""
Accept = Callable[[int, Sequence[MissionItem]], int]
"""(system that sends, items) to a MAV_MISSION_RESULT."""


@dataclass
class _Transfer:
    """An upload under way."""

    count: int
    heard_us: int
    asked_us: int
    items: list[MissionItem] = field(default_factory=list)


class MissionServer:
    """Serves uploads of missions. Hand it what is addressed to the companion, and the time."""

    def __init__(self, accept: Accept) -> None:
        self._accept = accept
        self._transfers: dict[Sender, _Transfer] = {}
        self._finished: dict[Sender, tuple[int, int]] = {}
        """By sender: sequence number of the last item of its last mission, and how that was answered."""

    @property
    def busy(self) -> bool:
        """Whether an upload is under way."""
        return bool(self._transfers)

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Takes MISSION_COUNT and MISSION_ITEM_INT; returns what to send."""
        sender = msg.get_srcSystem(), msg.get_srcComponent()
        kind = msg.get_type()
        if kind == "MISSION_COUNT":
            return [self._begin(now_us, sender, msg.count, msg.mission_type)]
        if kind == "MISSION_ITEM_INT" and msg.mission_type == MISSION:
            return self._take(now_us, sender, msg)
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks again for items that have not come, and forgets uploads that were given up."""
        self._transfers = {
            sender: transfer for sender, transfer in self._transfers.items() if now_us - transfer.heard_us <= GIVE_UP_US
        }
        late = [sender for sender, one in self._transfers.items() if now_us - one.asked_us >= REQUEST_AGAIN_US]
        return [self._request(now_us, sender) for sender in late]

    def _begin(self, now_us: int, sender: Sender, count: int, mission_type: int) -> mavlink.MAVLink_message:
        if mission_type != MISSION:
            return _ack(sender, UNSUPPORTED, mission_type)
        if not 0 < count <= MOST_ITEMS:
            return _ack(sender, NO_SPACE)
        self._finished.pop(sender, None)
        self._transfers[sender] = _Transfer(count, now_us, now_us)
        return self._request(now_us, sender)

    def _take(self, now_us: int, sender: Sender, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        transfer = self._transfers.get(sender)
        if transfer is None:
            last, result = self._finished.get(sender, (-1, ERROR))
            return [_ack(sender, result if msg.seq == last else ERROR)]
        transfer.heard_us = now_us
        if msg.seq != len(transfer.items):
            return []  # one that was asked for twice, or out of order: what is missing is asked for again
        params = (msg.param1, msg.param2, msg.param3, msg.param4)
        transfer.items.append(MissionItem(msg.frame, msg.command, *params, msg.x, msg.y, msg.z, msg.autocontinue))
        if len(transfer.items) < transfer.count:
            return [self._request(now_us, sender)]
        del self._transfers[sender]
        result = self._accept(sender[0], transfer.items)
        self._finished[sender] = (msg.seq, result)
        return [_ack(sender, result)]

    def _request(self, now_us: int, sender: Sender) -> mavlink.MAVLink_message:
        transfer = self._transfers[sender]
        transfer.asked_us = now_us
        return mavlink.MAVLink_mission_request_int_message(*sender, len(transfer.items), MISSION)


def _ack(sender: Sender, result: int, mission_type: int = MISSION) -> mavlink.MAVLink_message:
    return mavlink.MAVLink_mission_ack_message(*sender, result, mission_type)


__all__ = ["ACCEPTED", "UNSUPPORTED", "Accept", "MissionServer"]
