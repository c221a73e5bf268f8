"""Mission protocol: missions, fences and rally points up and down, in and out of order, taken and refused."""

import struct
import time
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import pytest

MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
X, Y = 473977418, 85455939
GLOBAL, MISSION_FRAME, RELATIVE, LOCAL_NED, GLOBAL_INT, RELATIVE_INT = 0, 2, 3, 1, 5, 6
ACCEPTED, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE, CANCELLED = 0, 1, 2, 3, 4, 15
INVALID_PARAM2, INVALID_PARAM3, INVALID_PARAM5, INVALID_PARAM7 = 7, 8, 10, 12
NO_MISSION, NOT_STARTED = 1, 2
SUSPENDED = 2
NO_TOTAL = 65535
DO_SET_MISSION_CURRENT = 224
RESULT_UNSUPPORTED = 3
NAN = float("nan")
RETRY_S, GIVES_UP_S, SETTLE_S, CURRENT_S = 0.25, 5.0, 5.0, 10.0
NAVIGATOR_S, CLEARINGS = 1.0, 3
HEADER_BYTES = 10
ID_OF_THREE_ITEMS = 1161622139
ASKED = ["MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"]
"""What an upload is answered; an item may be asked for once more while it is on its way."""
GIVEN = ["MISSION_ACK", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM"]
"""What a download is answered."""
PAGE = "https://mavlink.io/en/services/mission.html"
UP = ("MISSION_COUNT", "MISSION_REQUEST_INT", "MISSION_ITEM_INT", "MISSION_ACK")
DOWN = ("MISSION_REQUEST_LIST", "MISSION_COUNT", "MISSION_REQUEST_INT", "MISSION_ITEM_INT")


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


@pytest.fixture(scope="module", autouse=True)
def none_left(station: Any) -> Iterator[None]:
    """PX4's navigator tells a mission anew whose current item it sets (MissionBase::setMissionIndex): one that was
    cleared right behind its upload is then there again, and is cleared again."""
    yield
    for _ in range(CLEARINGS):
        station.collect("MISSION_CURRENT", NAVIGATOR_S, at_least=1)
        if settled_count(station, 0) == 0:
            break
        end(station, ACCEPTED)
        clear(station, ALL)
    end(station, ACCEPTED)


@pytest.fixture(autouse=True)
def empty(station: Any) -> Iterator[None]:
    """Every test begins and ends without a transfer and without a plan."""
    yield
    for kind in (MISSION, FENCE, RALLY):
        end(station, CANCELLED, kind)
    clear(station, ALL)


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
    while (reply := station.receive(ASKED)).get_type() != "MISSION_ACK" and reply.seq == seq:
        pass
    return reply


def is_ignored(station: Any, seq: int, item: Item, wanted: int) -> bool:
    """Whether an item is not answered; what is wanted may be asked for again meanwhile."""
    give(station, seq, item)
    asked = station.collect(ASKED, 0.1)
    return all(each.get_type() == "MISSION_REQUEST_INT" and each.seq == wanted for each in asked)


def upload(station: Any, items: Sequence[Item], kind: int = MISSION) -> Any:
    """Upload a plan; its MISSION_ACK."""
    reply = count(station, len(items), kind)
    while reply.get_type() != "MISSION_ACK":
        give(station, reply.seq, items[reply.seq], kind)
        reply = station.receive(ASKED)
        assert reply is not None
    return reply


def announced(station: Any, kind: int = MISSION) -> Any:
    """The MISSION_COUNT of a download, which is then to be ended."""
    station.mav.mission_request_list_send(station.system, 1, kind)
    return station.receive("MISSION_COUNT")


def settled_count(station: Any, expected: int, kind: int = MISSION) -> int:
    """How many items PX4 announces, once it has noticed a change (it takes a moment)."""
    end_s = time.monotonic() + SETTLE_S
    while (found := int(announced(station, kind).count)) != expected and time.monotonic() < end_s:
        end(station, ACCEPTED, kind)
    return found


def download(station: Any, expected: int, kind: int = MISSION) -> list[Any]:
    """The items of a plan."""
    assert settled_count(station, expected, kind) == expected
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


def plan_ids(message: Any, offset: int, number: int) -> tuple[int, ...]:
    """Opaque ids: extension fields that pymavlink's dialect does not have."""
    payload = bytes(message.get_msgbuf())[HEADER_BYTES:-2].ljust(64, b"\0")
    return struct.unpack_from(f"<{number}I", payload, offset)


def vehicle_time_s(station: Any) -> float:
    return float(station.receive("ATTITUDE").time_boot_ms) / 1000.0


def current(station: Any, *expected: int) -> tuple[int, int, int, int]:
    """(seq, total, state, mode) of the first MISSION_CURRENT that is as expected, or of the last one in time."""
    end_s = time.monotonic() + CURRENT_S
    while (message := station.receive("MISSION_CURRENT")) is not None:
        told = message.seq, message.total, message.mission_state, message.mission_mode
        if told == expected or time.monotonic() > end_s:
            break
    return told


# --- there and back ------------------------------------------------------------------------------------------


@pytest.mark.covers(*UP, *DOWN, source=PAGE)
@pytest.mark.covers("MISSION_CLEAR_ALL", source=PAGE)
@pytest.mark.parametrize("kind", [MISSION, FENCE, RALLY])
def test_a_plan_goes_up_and_comes_down_and_is_cleared(station: Any, kind: int) -> None:
    items = PLANS[kind]
    ack = upload(station, items, kind)
    assert (ack.type, ack.mission_type) == (ACCEPTED, kind)
    found = download(station, len(items), kind)
    assert [(each.seq, each.frame, each.command, each.x, each.y, each.z) for each in found] == [
        (seq, item.frame, item.command, item.x, item.y, item.z) for seq, item in enumerate(items)
    ]
    assert {each.mission_type for each in found} == {kind}
    ack = clear(station, kind)
    assert (ack.type, ack.mission_type) == (ACCEPTED, kind)
    assert settled_count(station, 0, kind) == 0
    end(station, ACCEPTED, kind)


@pytest.mark.covers(
    "MISSION_ITEM_INT",
    source="measured mission/transcript/*, mission/plan/fence/*/stored: item 0 is current; a fence does not continue",
)
def test_what_px4_adds_to_items(station: Any) -> None:
    upload(station, SQUARE, FENCE)
    found = download(station, 4, FENCE)
    assert [(each.current, each.autocontinue, each.param1) for each in found] == [(1, 0, 4.0), *[(0, 0, 4.0)] * 3]


@pytest.mark.covers(*UP, *DOWN, source="measured mission/size/200/*: a long plan comes back as it went")
def test_200_items(station: Any) -> None:
    assert upload(station, (TAKEOFF, *(Item(x=X + seq) for seq in range(1, 200)))).type == ACCEPTED
    assert [item.x for item in download(station, 200)] == [X + seq for seq in range(200)]


@pytest.mark.covers(
    "MISSION_ITEM",
    "MISSION_REQUEST",
    source="measured mission/transcript/mission/upload_float_int_frame: who speaks in floats is answered in floats",
)
def test_the_old_messages_with_floats(station: Any) -> None:
    reply = count(station, 1)
    assert reply.get_type() == "MISSION_REQUEST_INT"
    head = (station.system, 1, 0, RELATIVE, 16, 0, 1)
    station.mav.mission_item_send(*head, 0, 2.5, 0, 90.0, X * 1e-7, Y * 1e-7, 10.0, MISSION)
    assert station.receive("MISSION_ACK").type == ACCEPTED
    assert settled_count(station, 1) == 1
    station.mav.mission_request_send(station.system, 1, 0, MISSION)
    item = station.receive("MISSION_ITEM")
    assert (item.frame, item.command, item.param2, item.param4, item.z) == (RELATIVE, 16, 2.5, 90.0, 10.0)
    assert (item.x, item.y) == (pytest.approx(X * 1e-7, abs=1e-5), pytest.approx(Y * 1e-7, abs=1e-5))
    end(station, ACCEPTED)
    assert count(station, 1).get_type() == "MISSION_REQUEST"
    give(station, 0, TAKEOFF)
    assert station.receive("MISSION_ACK").type == ACCEPTED


@pytest.mark.covers(
    "MISSION_ACK",
    "MISSION_COUNT",
    "MISSION_CURRENT",
    source="measured mission/opaque_id/*: a CRC-32 of what was uploaded",
)
def test_the_opaque_id_of_a_plan_is_told_everywhere(station: Any) -> None:
    ack = upload(station, THREE)
    assert plan_ids(ack, 4, 1) == (ID_OF_THREE_ITEMS,)
    assert settled_count(station, 3) == 3
    end(station, ACCEPTED)
    assert plan_ids(announced(station), 5, 1) == (ID_OF_THREE_ITEMS,)
    end(station, ACCEPTED)
    assert current(station, 0, 3, NOT_STARTED, SUSPENDED)[1] == 3
    assert plan_ids(station.receive("MISSION_CURRENT"), 6, 3) == (ID_OF_THREE_ITEMS, 0, 0)


@pytest.mark.covers("PARAM_VALUE", source="PX4 src/modules/navigator/MissionFeasibility/FeasibilityChecker.cpp")
def test_once_a_mission_was_checked_the_parameters_of_its_check_are_in_the_list(station: Any) -> None:
    upload(station, THREE)
    for name in ("FW_LND_ANG", "MIS_DIST_1WP", "MIS_TKO_LAND_REQ"):
        assert station.is_listed(name)


# --- what is taken, and what is kept ---------------------------------------------------------------------------


@pytest.mark.covers(
    "MISSION_COUNT", source="measured mission/count/*: 10000 mission items, 64 of a fence, 32 rally points"
)
@pytest.mark.parametrize(("kind", "most"), [(MISSION, 10_000), (FENCE, 64), (RALLY, 32)])
def test_limits(station: Any, kind: int, most: int) -> None:
    reply = count(station, most, kind)
    assert (reply.get_type(), reply.seq, reply.mission_type) == ("MISSION_REQUEST_INT", 0, kind)
    end(station, CANCELLED, kind)
    for more in (most + 1, 65535):
        reply = count(station, more, kind)
        assert (reply.get_type(), reply.type, reply.mission_type) == ("MISSION_ACK", NO_SPACE, kind)


@pytest.mark.covers(
    "MISSION_COUNT",
    source="measured mission/count/mission/0, mission/plan/unknown_type_*: nothing is a plan, of three kinds",
)
@pytest.mark.parametrize(("number", "kind", "result"), [(0, MISSION, ACCEPTED), (1, 3, NO_SPACE), (1, ALL, NO_SPACE)])
def test_counts_that_are_answered_at_once(station: Any, number: int, kind: int, result: int) -> None:
    reply = count(station, number, kind)
    assert (reply.get_type(), reply.type, reply.mission_type) == ("MISSION_ACK", result, kind)


@pytest.mark.covers(
    "MISSION_ACK",
    source="measured mission/frame/*, mission/item_command/*, mission/bad_item/*: frames, commands, unused parameters",
)
@pytest.mark.parametrize(
    ("item", "result"),
    [
        (Item(frame=GLOBAL_INT), ACCEPTED),
        (Item(frame=RELATIVE), ACCEPTED),
        (Item(frame=LOCAL_NED), UNSUPPORTED_FRAME),
        (Item(frame=7), UNSUPPORTED_FRAME),
        (Item(frame=20), UNSUPPORTED_FRAME),
        (Item(frame=MISSION_FRAME), UNSUPPORTED),
        (Item(params=(NAN,) * 4), ACCEPTED),
        (Item(params=(1.0, 2.0, 3.0, 4.0)), INVALID_PARAM3),
        (Item(22, params=(0.0, 2.0, 0.0, 0.0)), INVALID_PARAM2),
        (Item(z=NAN), ACCEPTED),
        (Item(x=950_000_000), ACCEPTED),
        (Item(x=0, y=0), ACCEPTED),
        (Item(18), UNSUPPORTED),
        (Item(183), UNSUPPORTED),
        (Item(1), UNSUPPORTED),
        (Item(19), ACCEPTED),
        (Item(31), ACCEPTED),
        (Item(80, MISSION_FRAME), ACCEPTED),
        (Item(177), INVALID_PARAM5),
        (Item(177, MISSION_FRAME, (50.0, 3.0, 0.0, 0.0)), INVALID_PARAM5),
        (Item(178, MISSION_FRAME, (1.0, -5.0, 0.0, 0.0)), INVALID_PARAM5),
        (Item(178, MISSION_FRAME, (1.0, 5.0, 0.0, 0.0), 0, 0, 0.0), ACCEPTED),
        (Item(179), UNSUPPORTED),
        (Item(179, MISSION_FRAME), ACCEPTED),
        (Item(189, MISSION_FRAME), ACCEPTED),
        (Item(201, params=(9.0, 0.0, 0.0, 0.0)), INVALID_PARAM5),
        (Item(211, MISSION_FRAME, (9.0, 9.0, 0.0, 0.0)), INVALID_PARAM5),
        (Item(1000), UNSUPPORTED),
        (Item(1000, MISSION_FRAME), ACCEPTED),
        (Item(2000, MISSION_FRAME), INVALID_PARAM5),
        (Item(5001), INVALID_PARAM7),
        (Item(5100), ERROR),
        (Item(5100, MISSION_FRAME), UNSUPPORTED),
    ],
)
def test_items_of_a_mission(station: Any, item: Item, result: int) -> None:
    ack = upload(station, [item])
    assert (ack.type, ack.mission_type) == (result, MISSION)


@pytest.mark.covers("MISSION_ACK", source="measured mission/plan/*: what is taken as a fence, and as rally points")
@pytest.mark.parametrize(
    ("kind", "items", "result"),
    [
        (FENCE, [item._replace(params=(2.0, 0.0, 0.0, 0.0)) for item in SQUARE[:2]], ERROR),
        (FENCE, [item._replace(params=(5.0, 0.0, 0.0, 0.0)) for item in SQUARE], ACCEPTED),
        (FENCE, [Item(5003, GLOBAL_INT, (100.0, 0.0, 0.0, 0.0), z=0.0)], ACCEPTED),
        (FENCE, [Item(5003, GLOBAL_INT, (-5.0, 0.0, 0.0, 0.0), z=0.0)], ACCEPTED),
        (FENCE, [Item(5004, GLOBAL_INT, (10.0, 0.0, 0.0, 0.0))], INVALID_PARAM7),
        (FENCE, [Item(5003, MISSION_FRAME)], INVALID_PARAM7),
        (FENCE, [Item(5000, GLOBAL_INT)], ACCEPTED),
        (FENCE, [Item(16)], ACCEPTED),
        (RALLY, [Item(5100, GLOBAL_INT)], ACCEPTED),
        (RALLY, [Item(16)], ACCEPTED),
        (RALLY, [Item(5100, MISSION_FRAME)], UNSUPPORTED),
    ],
)
def test_items_of_other_plans(station: Any, kind: int, items: list[Item], result: int) -> None:
    ack = upload(station, items, kind)
    assert (ack.type, ack.mission_type) == (result, kind)


@pytest.mark.covers(
    "MISSION_ITEM_INT", source="measured mission/item_stored/*: kept in frames 5 and 6; yes or no for what is one"
)
@pytest.mark.parametrize(
    ("item", "kept"),
    [
        (Item(frame=GLOBAL), (GLOBAL_INT, 16, (0.0, 0.0, 0.0, 0.0))),
        (Item(frame=RELATIVE), (RELATIVE_INT, 16, (0.0, 0.0, 0.0, 0.0))),
        (Item(19, params=(1.0, 2.0, 3.0, 4.0)), (RELATIVE_INT, 19, (1.0, 1.0, 3.0, 1.0))),
    ],
)
def test_what_is_kept_of_an_item(station: Any, item: Item, kept: tuple[int, int, tuple[float, ...]]) -> None:
    assert upload(station, [item]).type == ACCEPTED
    found = download(station, 1)[0]
    params = (found.param1, found.param2, found.param3, found.param4)
    assert (found.frame, found.command, params) == kept


@pytest.mark.covers(
    "MISSION_ACK", "STATUSTEXT", source="measured mission/bad_item/*: a refused item ends the upload, and is told"
)
def test_a_refused_plan_leaves_the_old_one(station: Any) -> None:
    upload(station, THREE)
    assert upload(station, [TAKEOFF, Item(183)]).type == UNSUPPORTED
    assert is_said(station, "IGN MISSION_ITEM: Invalid item\t")
    assert [item.command for item in download(station, 3)] == [22, 16, 16]


# --- order and silence -----------------------------------------------------------------------------------------


@pytest.mark.covers(*UP, source="measured mission/order/upload/*: only the item that was asked for counts")
def test_items_out_of_order_are_not_taken(station: Any) -> None:
    assert count(station, 4).seq == 0
    assert is_ignored(station, 2, THREE[2], wanted=0)
    assert answer(station, 0, THREE[0]).seq == 1
    assert is_ignored(station, 0, THREE[0], wanted=1)
    assert answer(station, 1, THREE[1]).seq == 2
    assert is_ignored(station, 0, THREE[0], wanted=2)


@pytest.mark.covers(
    "MISSION_COUNT",
    source="measured mission/order/upload/count_again: answered anew before the first item, then refused",
)
def test_a_count_again(station: Any) -> None:
    for _ in range(2):
        reply = count(station, 4)
        assert (reply.get_type(), reply.seq) == ("MISSION_REQUEST_INT", 0)
    assert answer(station, 0, TAKEOFF).seq == 1
    reply = count(station, 4)
    assert (reply.get_type(), reply.type, reply.mission_type) == ("MISSION_ACK", ERROR, MISSION)
    assert is_said(station, "WPM: REJ. CMD: Busy\t")


@pytest.mark.covers(
    "MISSION_COUNT", source="measured mission/concurrent/*: while one uploads, another is refused, and told so himself"
)
def test_one_upload_at_a_time(station: Any) -> None:
    assert count(station, 3).seq == 0
    station.mav.srcSystem = 254
    try:
        station.mav.mission_count_send(station.system, 1, 2, MISSION)
    finally:
        station.mav.srcSystem = 255
    ack = station.receive("MISSION_ACK")
    assert (ack.target_system, ack.type) == (254, ERROR)
    assert answer(station, 0, TAKEOFF).seq == 1


@pytest.mark.covers("MISSION_REQUEST_INT", source=f"{PAGE}#timeout")
@pytest.mark.covers("MISSION_REQUEST_INT", source="measured mission/silent_upload/*: asked again every 0.27 s")
def test_an_item_that_does_not_come_is_asked_for_again(station: Any) -> None:
    assert count(station, 3).seq == 0
    assert answer(station, 0, TAKEOFF).seq == 1
    asked = station.collect("MISSION_REQUEST_INT", 4 * RETRY_S + 0.1, at_least=2)
    assert {each.seq for each in asked} == {1}
    assert len(asked) in (2, 3, 4)


@pytest.mark.covers("MISSION_REQUEST_INT", "STATUSTEXT", source="PX4 src/modules/mavlink/mavlink_mission.cpp")
def test_an_upload_is_given_up_and_told(station: Any) -> None:
    assert count(station, 3).seq == 0
    began_s = vehicle_time_s(station)
    assert is_said(station, "Mission sync timeout\t", 60.0)
    assert vehicle_time_s(station) - began_s == pytest.approx(GIVES_UP_S, abs=0.5)
    station.collect("MISSION_REQUEST_INT", 0.1)
    assert station.receive("MISSION_REQUEST_INT", 2 * RETRY_S) is None


@pytest.mark.covers("MISSION_COUNT", "STATUSTEXT", source="PX4 src/modules/mavlink/mavlink_mission.cpp")
def test_a_count_that_nobody_takes_is_repeated_and_given_up(station: Any) -> None:
    upload(station, THREE)
    assert settled_count(station, 3) == 3
    repeated = station.collect("MISSION_COUNT", 4 * RETRY_S + 0.1, at_least=2)
    assert {each.count for each in repeated} == {3}
    assert len(repeated) in (2, 3, 4, 5)
    assert is_said(station, "Mission sync timeout\t", 60.0)
    station.collect("MISSION_COUNT", 0.1)
    assert station.receive("MISSION_COUNT", 2 * RETRY_S) is None


@pytest.mark.covers("MISSION_ACK", source=f"{PAGE}#cancel")
def test_an_upload_is_cancelled(station: Any) -> None:
    upload(station, THREE)
    assert count(station, 2).seq == 0
    end(station, CANCELLED)
    station.collect("MISSION_REQUEST_INT", 0.1)
    assert station.receive("MISSION_REQUEST_INT", 2 * RETRY_S) is None
    assert settled_count(station, 3) == 3
    end(station, ACCEPTED)


@pytest.mark.covers(
    "MISSION_ITEM_INT",
    "MISSION_ACK",
    source="measured mission/order/idle/last_item_again: whose acknowledgement was lost gets it again",
)
def test_the_last_item_again_is_acknowledged_again(station: Any) -> None:
    upload(station, THREE)
    reply = answer(station, 2, THREE[2])
    assert (reply.get_type(), reply.type) == ("MISSION_ACK", ACCEPTED)


@pytest.mark.covers(
    "MISSION_ITEM_INT", "STATUSTEXT", source="measured mission/order/idle/item: MAV_MISSION_ERROR, and a text"
)
def test_an_item_that_nobody_asked_for_is_refused(station: Any) -> None:
    upload(station, THREE)
    give(station, 7, THREE[1])
    assert station.receive("MISSION_ACK").type == ERROR
    give(station, 7, THREE[1])
    assert is_said(station, "IGN MISSION_ITEM: No transfer\t")


@pytest.mark.covers("MISSION_REQUEST_INT", source="measured mission/order/idle/request: no answer without a download")
def test_a_request_without_a_download_has_no_answer(station: Any) -> None:
    upload(station, THREE)
    station.mav.mission_request_int_send(station.system, 1, 0, MISSION)
    assert station.receive(GIVEN, 0.4) is None


@pytest.mark.covers(
    "MISSION_REQUEST_INT",
    "STATUSTEXT",
    source="measured mission/order/download/*: MAV_MISSION_ERROR ends the download; a text",
)
@pytest.mark.parametrize("seq", [2, 9])
def test_a_download_goes_item_by_item(station: Any, seq: int) -> None:
    upload(station, (*THREE, Item()))
    assert settled_count(station, 4) == 4
    station.mav.mission_request_int_send(station.system, 1, seq, MISSION)
    assert station.receive("MISSION_ACK").type == ERROR
    assert is_said(station, "WPM: REJ. CMD: Req. WP was unexpected\t")


@pytest.mark.covers("MISSION_REQUEST_INT", source=f"{PAGE}#download_mission")
def test_an_item_is_sent_again(station: Any) -> None:
    upload(station, THREE)
    assert settled_count(station, 3) == 3
    for seq in (0, 0, 1, 1, 2, 2):
        station.mav.mission_request_int_send(station.system, 1, seq, MISSION)
        assert station.receive("MISSION_ITEM_INT").seq == seq


@pytest.mark.covers(
    "MISSION_WRITE_PARTIAL_LIST", "MISSION_REQUEST_PARTIAL_LIST", source="measured mission/partial/*: no answer"
)
def test_partial_lists_are_not_known(station: Any) -> None:
    upload(station, THREE)
    station.mav.mission_write_partial_list_send(station.system, 1, 1, 2, MISSION)
    station.mav.mission_request_partial_list_send(station.system, 1, 1, 2, MISSION)
    assert station.receive(GIVEN, 0.5) is None


@pytest.mark.covers(
    "MISSION_CLEAR_ALL", source="measured mission/clear/*: accepted for all kinds, and for one that is not known"
)
@pytest.mark.parametrize("kind", [ALL, 7])
def test_clearing_other_kinds(station: Any, kind: int) -> None:
    upload(station, THREE)
    upload(station, SQUARE, FENCE)
    ack = clear(station, kind)
    assert (ack.type, ack.mission_type) == (ACCEPTED, kind)
    for each, number in ((MISSION, 3), (FENCE, 4)):
        expected = 0 if kind == ALL else number
        assert settled_count(station, expected, each) == expected
        end(station, ACCEPTED, each)


# --- the current item ------------------------------------------------------------------------------------------


@pytest.mark.covers(
    "MISSION_CURRENT", source="measured mission/current/after_upload: no total without a mission; not started with one"
)
def test_the_current_item_is_told(station: Any) -> None:
    for items, told in (((), (0, NO_TOTAL, NO_MISSION, SUSPENDED)), (THREE, (0, 3, NOT_STARTED, SUSPENDED))):
        upload(station, items)
        assert current(station, *told) == told


@pytest.mark.covers("MISSION_SET_CURRENT", "MISSION_CURRENT", source="https://mavlink.io/en/messages/common.html")
def test_the_current_item_is_set(station: Any) -> None:
    """PX4's navigator has taken the mission over when MISSION_CURRENT tells it: before, it would begin it anew."""
    upload(station, (*THREE, Item()))
    first, third = (0, 4, NOT_STARTED, SUSPENDED), (2, 4, NOT_STARTED, SUSPENDED)
    assert current(station, *first) == first
    station.mav.mission_set_current_send(station.system, 1, 2)
    assert current(station, *third) == third
    station.mav.mission_set_current_send(station.system, 1, 4)
    assert is_said(station, "WPM: WP CURR CMD: Not in list\t")
    station.receive("MISSION_CURRENT")
    assert current(station, *third) == third


@pytest.mark.covers(
    "MAV_CMD_DO_SET_MISSION_CURRENT", source="measured mission/set_current/command/*: MAV_RESULT_UNSUPPORTED"
)
def test_the_command_for_it_is_not_known(station: Any) -> None:
    upload(station, THREE)
    assert station.command(DO_SET_MISSION_CURRENT, 1) == RESULT_UNSUPPORTED
