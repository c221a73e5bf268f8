"""Mission protocol: plans go up and come down, in and out of order, are repeated, given up, cancelled and cleared."""

import struct
from typing import Any

import pytest

from .plans import (
    ACCEPTED,
    ALL,
    ASKED,
    CANCELLED,
    ERROR,
    FENCE,
    MISSION,
    NOT_STARTED,
    PLANS,
    RALLY,
    RELATIVE,
    SQUARE,
    SUSPENDED,
    TAKEOFF,
    THREE,
    Item,
    X,
    Y,
    announced,
    answer,
    clear,
    count,
    current,
    download,
    end,
    give,
    is_said,
    settled_count,
    upload,
)

RETRY_S, GIVES_UP_S = 0.25, 5.0
HEADER_BYTES = 10
ID_OF_THREE_ITEMS = 1161622139
GIVEN = ["MISSION_ACK", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM"]
"""What a download is answered."""
PAGE = "https://mavlink.io/en/services/mission.html"
UP = ("MISSION_COUNT", "MISSION_REQUEST_INT", "MISSION_ITEM_INT", "MISSION_ACK")
DOWN = ("MISSION_REQUEST_LIST", "MISSION_COUNT", "MISSION_REQUEST_INT", "MISSION_ITEM_INT")


def is_ignored(station: Any, seq: int, item: Item, wanted: int) -> bool:
    """Whether an item is not answered; what is wanted may be asked for again meanwhile."""
    give(station, seq, item)
    asked = station.collect(ASKED, 0.1)
    return all(each.get_type() == "MISSION_REQUEST_INT" and each.seq == wanted for each in asked)


def plan_ids(message: Any, offset: int, number: int) -> tuple[int, ...]:
    """Opaque ids: extension fields that pymavlink's dialect does not have."""
    payload = bytes(message.get_msgbuf())[HEADER_BYTES:-2].ljust(64, b"\0")
    return struct.unpack_from(f"<{number}I", payload, offset)


def vehicle_time_s(station: Any) -> float:
    return float(station.receive("ATTITUDE").time_boot_ms) / 1000.0


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
    began_s = vehicle_time_s(station)
    assert answer(station, 0, TAKEOFF).seq == 1
    asked = station.collect("MISSION_REQUEST_INT", 4 * RETRY_S + 0.1, at_least=2)
    took_s = vehicle_time_s(station) - began_s
    assert {each.seq for each in asked} == {1}
    assert 2 <= len(asked) <= took_s / RETRY_S


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
    began_s = vehicle_time_s(station)
    assert settled_count(station, 3) == 3
    repeated = station.collect("MISSION_COUNT", 4 * RETRY_S + 0.1, at_least=2)
    took_s = vehicle_time_s(station) - began_s
    assert {each.count for each in repeated} == {3}
    assert 2 <= len(repeated) <= took_s / RETRY_S + 1
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
