"""The plans of a vehicle that is not ours: kept before the tests of the mission protocol, and given back after them.

Not by mission/plans.py, whose client asserts what PX4 answers: here a message may be lost, and any autopilot may answer
as the protocol allows (https://mavlink.io/en/services/mission.html). What is kept lies in files as well until it is
back, so that nothing is lost: as text of `QGC WPL 110`, which ground stations load (https://mavlink.io/en/file_formats/).
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from .station import AUTOPILOT, FENCE, MISSION, RALLY, Station

KINDS = {MISSION: "mission", FENCE: "fence", RALLY: "rally"}
REPLY_S, TRIES = 3.0, 5
"""Ours: a message over a slow radio, and how often it may be lost."""
BUSY_S = 1.5
"""A transfer that a test left is given up by PX4 after 5 s without a word (mavlink_mission.h): TRIES outlast it."""
SETTLE_S = 10.0
ACCEPTED, CANCELLED = 0, 15
MISSION_FRAME = 2
"""MAV_FRAME_MISSION, whose x and y are no degrees."""


class Item(NamedTuple):
    """A plan item as MISSION_ITEM_INT has it, without what the autopilot sets itself (current)."""

    frame: int
    command: int
    autocontinue: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float

    def line(self, number: int) -> str:
        """As a line of a file."""
        scale = 1.0 if self.frame == MISSION_FRAME else 1e-7
        numbers = (*self.params, self.x * scale, self.y * scale, self.z)
        parts = (number, int(number == 0), self.frame, self.command, *(f"{each:.9g}" for each in numbers[:4]))
        return "\t".join(map(str, (*parts, *(f"{each:.8f}" for each in numbers[4:]), self.autocontinue)))


class Plans(NamedTuple):
    """What a vehicle holds: by kind, for the kinds that it knows; and which item of its mission is the current one."""

    items: dict[int, tuple[Item, ...]]
    current: int

    def __bool__(self) -> bool:
        return any(self.items.values())

    def write(self) -> Path:
        """Put them into files, one a kind, in a new folder."""
        folder = Path(tempfile.mkdtemp(prefix="sitl_emu-plans-"))
        for kind, items in self.items.items():
            if items:
                lines = ["QGC WPL 110", *(item.line(number) for number, item in enumerate(items))]
                (folder / f"{KINDS[kind]}.waypoints").write_text("\n".join(lines) + "\n")
        return folder


def held(station: Station) -> Plans:
    """Download them; raises TimeoutError if one that was announced does not come."""
    items = {kind: _downloaded(station, kind) for kind in KINDS}
    current = station.receive("MISSION_CURRENT", REPLY_S) if items[MISSION] else None
    return Plans({kind: plan for kind, plan in items.items() if plan is not None}, current.seq if current else 0)


def take_away(station: Station, plans: Plans) -> None:
    """Clear them; raises TimeoutError if one stays."""
    for kind, items in plans.items.items():
        if items:
            _give(station, kind, ())


def give_back(station: Station, plans: Plans) -> None:
    """Upload those that are no longer as they were; raises TimeoutError if one of them does not get there."""
    failed = list[str]()
    for kind, items in plans.items.items():
        station.mav.mission_ack_send(station.system, AUTOPILOT, CANCELLED, kind)
        try:
            if not _is_held(station, kind, items):
                _give(station, kind, items)
            if kind == MISSION and plans.current:
                _choose(station, plans.current, len(items))
        except TimeoutError as error:
            failed.append(str(error))
    if failed:
        raise TimeoutError("; ".join(failed))


def _answer(station: Station, send: Callable[[], None], names: list[str], fits: Callable[[Any], bool]) -> Any:
    """The first fitting message of these after what is sent; it is sent again if none comes. None if none does."""
    for _ in range(TRIES):
        send()
        end_s = time.monotonic() + REPLY_S
        while (left_s := end_s - time.monotonic()) > 0.0:
            message = station.receive(names, left_s)
            if message is not None and fits(message):
                return message
    return None


def _downloaded(station: Station, kind: int) -> tuple[Item, ...] | None:
    """A plan; None if the autopilot does not tell how many items it has, as one without such plans."""
    to = (station.system, AUTOPILOT)

    def of_kind(message: Any) -> bool:
        return bool(message.mission_type == kind)

    count = _answer(
        station, lambda: station.mav.mission_request_list_send(*to, kind), ["MISSION_COUNT", "MISSION_ACK"], of_kind
    )
    if count is None or count.get_type() == "MISSION_ACK":
        return None
    items = list[Item]()
    for seq in range(count.count):
        item = _answer(
            station,
            lambda seq=seq: station.mav.mission_request_int_send(*to, seq, kind),  # type: ignore[misc]
            ["MISSION_ITEM_INT"],
            lambda message, seq=seq: of_kind(message) and message.seq == seq,  # type: ignore[misc]
        )
        if item is None:
            raise TimeoutError(f"item {seq} of its {KINDS[kind]} does not come")
        items.append(_item(item))
    station.mav.mission_ack_send(*to, ACCEPTED, kind)
    return tuple(items)


def _item(message: Any) -> Item:
    params = (message.param1, message.param2, message.param3, message.param4)
    return Item(message.frame, message.command, message.autocontinue, params, message.x, message.y, message.z)


def _give(station: Station, kind: int, items: tuple[Item, ...]) -> None:
    """Make a plan the vehicle's, and see that it is."""
    for _ in range(TRIES):
        if _uploaded(station, kind, items) and _gets_held(station, kind, items):
            return
        station.collect("HEARTBEAT", BUSY_S)
    raise TimeoutError(f"it does not take its {KINDS[kind]} of {len(items)} items")


def _is_held(station: Station, kind: int, items: tuple[Item, ...]) -> bool:
    """Whether a plan is what the vehicle holds; a parameter that is left out (NaN) is like another."""
    return repr(_downloaded(station, kind)) == repr(items)


def _gets_held(station: Station, kind: int, items: tuple[Item, ...]) -> bool:
    """The same, soon: PX4 announces the old count for a moment after a plan was changed."""
    end_s = time.monotonic() + SETTLE_S
    while not (held := _is_held(station, kind, items)) and time.monotonic() < end_s:
        station.collect("HEARTBEAT", BUSY_S)
    return held


def _uploaded(station: Station, kind: int, items: tuple[Item, ...]) -> bool:
    """Whether an upload, or with nothing to upload a removal, is accepted."""
    to = (station.system, AUTOPILOT)

    def offer() -> None:
        if items:
            station.mav.mission_count_send(*to, len(items), kind)
        else:
            station.mav.mission_clear_all_send(*to, kind)

    asked = ["MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"]
    reply = _answer(station, offer, asked, lambda message: message.mission_type == kind)
    while reply is not None and reply.get_type() != "MISSION_ACK":
        seq = min(reply.seq, len(items) - 1)
        item = items[seq]
        head = (*to, seq, item.frame, item.command, 0, item.autocontinue)
        station.mav.mission_item_int_send(*head, *item.params, item.x, item.y, item.z, kind)
        # An item that was lost is asked for again by the autopilot
        reply = station.receive(asked, REPLY_S)
    return bool(reply is not None and reply.type == ACCEPTED)


def _choose(station: Station, current: int, total: int) -> None:
    """Make an item the current one again, once PX4's navigator has taken the mission over: before, it begins anew."""
    end_s = time.monotonic() + SETTLE_S
    while time.monotonic() < end_s:
        told = station.receive("MISSION_CURRENT", REPLY_S)
        if told is not None and told.total == total:
            if told.seq == current:
                return
            station.mav.mission_set_current_send(station.system, AUTOPILOT, current)
    raise TimeoutError(f"item {current} of its mission does not become the current one again")
