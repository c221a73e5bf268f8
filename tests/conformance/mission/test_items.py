"""Mission protocol: which items, and how many, are taken as a mission, a fence and rally points, and what is kept."""

from typing import Any

import pytest

from .plans import (
    ACCEPTED,
    ALL,
    CANCELLED,
    ERROR,
    FENCE,
    GLOBAL,
    GLOBAL_INT,
    INVALID_PARAM2,
    INVALID_PARAM3,
    INVALID_PARAM5,
    INVALID_PARAM7,
    LOCAL_NED,
    MISSION,
    MISSION_FRAME,
    NO_SPACE,
    RALLY,
    RELATIVE,
    RELATIVE_INT,
    SQUARE,
    TAKEOFF,
    THREE,
    UNSUPPORTED,
    UNSUPPORTED_FRAME,
    Item,
    count,
    download,
    end,
    is_said,
    upload,
)

NAN = float("nan")


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
