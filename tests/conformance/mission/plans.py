"""Mission protocol, its client side: plans, and a ground station that uploads, downloads and clears them."""

import time
from collections.abc import Sequence
from typing import Any, NamedTuple

MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
X, Y = 473977418, 85455939
GLOBAL, MISSION_FRAME, RELATIVE, LOCAL_NED, GLOBAL_INT, RELATIVE_INT = 0, 2, 3, 1, 5, 6
ACCEPTED, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE, CANCELLED = 0, 1, 2, 3, 4, 15
INVALID_PARAM2, INVALID_PARAM3, INVALID_PARAM5, INVALID_PARAM7 = 7, 8, 10, 12
NO_MISSION, NOT_STARTED = 1, 2
SUSPENDED = 2
SETTLE_S, CURRENT_S = 5.0, 10.0
ASKED = ["MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"]
"""What an upload is answered; an item may be asked for once more while it is on its way."""


class Item(NamedTuple):
    """A plan item as MISSION_ITEM_INT has it; degrees times 1e7, metres."""

    command: int = 16
    frame: int = RELATIVE_INT
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    x: int = X
    y: int = Y
    z: float = 10.0
    current: int = 0


TAKEOFF = Item(22, current=1)
THREE = (TAKEOFF, Item(x=X + 300), Item(x=X + 600))
CORNERS = ((-9000, -9000), (-9000, 9000), (9000, 9000), (9000, -9000))
SQUARE = tuple(Item(5001, GLOBAL_INT, (4.0, 0.0, 0.0, 0.0), X + dx, Y + dy, 0.0) for dx, dy in CORNERS)
RALLY_POINTS = (Item(5100), Item(5100, x=X + 300))
PLANS = {MISSION: THREE, FENCE: SQUARE, RALLY: RALLY_POINTS}


def count(station: Any, number: int, kind: int = MISSION) -> Any:
    """What MISSION_COUNT is answered."""
    station.mav.mission_count_send(station.system, 1, number, kind)
    return station.receive(ASKED)


def give(station: Any, seq: int, item: Item, kind: int = MISSION) -> None:
    head = (station.system, 1, seq, item.frame, item.command, item.current, 1)
    station.mav.mission_item_int_send(*head, *item.params, item.x, item.y, item.z, kind)


def answer(station: Any, seq: int, item: Item, kind: int = MISSION) -> Any:
    """What an item is answered; it may have been asked for again on its way."""
    give(station, seq, item, kind)
    while True:
        reply = station.receive(ASKED)
        assert reply is not None, f"item {seq} is not answered"
        if reply.get_type() == "MISSION_ACK" or reply.seq != seq:
            return reply


def upload(station: Any, items: Sequence[Item], kind: int = MISSION) -> Any:
    """Upload a plan; its MISSION_ACK."""
    reply = count(station, len(items), kind)
    assert reply is not None, "MISSION_COUNT is not answered"
    while reply.get_type() != "MISSION_ACK":
        give(station, reply.seq, items[reply.seq], kind)
        reply = station.receive(ASKED)
        assert reply is not None, "the upload is not answered any more"
    return reply


def announced(station: Any, kind: int = MISSION) -> Any:
    """The MISSION_COUNT of a download, which is then to be ended."""
    station.mav.mission_request_list_send(station.system, 1, kind)
    return station.receive("MISSION_COUNT")


def settled_count(station: Any, expected: int, kind: int = MISSION) -> int:
    """How many items PX4 announces, once it has noticed a change (it takes a moment)."""
    end_s = time.monotonic() + SETTLE_S
    while True:
        told = announced(station, kind)
        assert told is not None, "MISSION_REQUEST_LIST is not answered"
        if told.count == expected or time.monotonic() > end_s:
            return int(told.count)
        end(station, ACCEPTED, kind)


def download(station: Any, expected: int, kind: int = MISSION) -> list[Any]:
    """The items of a plan."""
    found = settled_count(station, expected, kind)
    assert found == expected, f"{found} items are announced, not {expected}"
    items = []
    for seq in range(expected):
        station.mav.mission_request_int_send(station.system, 1, seq, kind)
        items.append(station.receive("MISSION_ITEM_INT"))
    end(station, ACCEPTED, kind)
    return items


def end(station: Any, result: int, kind: int = MISSION) -> None:
    """Our MISSION_ACK ends a download, and cancels an upload."""
    station.mav.mission_ack_send(station.system, 1, result, kind)


def clear(station: Any, kind: int) -> Any:
    station.mav.mission_clear_all_send(station.system, 1, kind)
    return station.receive("MISSION_ACK")


def is_said(station: Any, text: str, limit_s: float = 10.0) -> bool:
    """Whether a text comes; texts of what was before may come late."""
    end_s = time.monotonic() + limit_s
    while (left_s := end_s - time.monotonic()) > 0.0:
        message = station.receive("STATUSTEXT", left_s)
        if message is not None and message.text == text:
            return True
    return False


def current(station: Any, *expected: int) -> tuple[int, int, int, int]:
    """(seq, total, state, mode) of the first MISSION_CURRENT that is as expected, or of the last one in time."""
    end_s = time.monotonic() + CURRENT_S
    while True:
        message = station.receive("MISSION_CURRENT")
        assert message is not None, "no MISSION_CURRENT"
        told = message.seq, message.total, message.mission_state, message.mission_mode
        if told == expected or time.monotonic() > end_s:
            return told
