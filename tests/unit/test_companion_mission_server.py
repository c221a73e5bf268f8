"""A companion takes missions from its peers, as PX4 takes them from a ground station: transcripts of its half."""

from collections.abc import Sequence
from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.mission import MissionItem, MissionUpload
from sitl_emu.missions.companion.mission_server import MissionServer
from tests.unit.companion_px4 import on_the_wire

ME, SCOUT, OTHER = 2, 1, 3
MS = 1_000
ITEMS = [MissionItem(3, 16, x=404_700_000, y=-869_900_000), MissionItem(3, 31005, param2=0.5, param3=1.0)]


class Taken:
    """Keeps what was uploaded, and answers as it was told to."""

    def __init__(self, result: int = 0) -> None:
        self.result = result
        self.missions: list[tuple[int, list[MissionItem]]] = []

    def __call__(self, system: int, items: Sequence[MissionItem]) -> int:
        self.missions.append((system, list(items)))
        return self.result


def said(messages: list[Any]) -> list[str]:
    """Requests as "request 0 > 1", acknowledgements as "ack 0 > 1": what, which, to whom."""
    return [
        f"request {msg.seq} > {msg.target_system}"
        if msg.get_type() == "MISSION_REQUEST_INT"
        else f"ack {msg.type} > {msg.target_system}"
        for msg in messages
    ]


def count(number: int, by: int = SCOUT, mission_type: int = 0) -> Any:
    return on_the_wire(mavlink.MAVLink_mission_count_message(ME, 191, number, mission_type), by, 191)


def item(seq: int, by: int = SCOUT) -> Any:
    one = ITEMS[seq]
    return on_the_wire(
        mavlink.MAVLink_mission_item_int_message(ME, 191, seq, one.frame, one.command, 0, 1, *one[2:9], 0), by, 191
    )


def test_an_upload_is_asked_for_item_by_item_and_acknowledged() -> None:
    taken = Taken()
    server = MissionServer(taken)
    assert said(server.on_message(0, count(2))) == ["request 0 > 1"]
    assert server.busy
    assert said(server.on_message(10 * MS, item(0))) == ["request 1 > 1"]
    assert not taken.missions
    assert said(server.on_message(20 * MS, item(1))) == ["ack 0 > 1"]
    assert taken.missions == [(SCOUT, ITEMS)]
    assert not server.busy


def test_an_item_that_does_not_come_is_asked_for_again_every_quarter_of_a_second_until_5_s_have_passed() -> None:
    server = MissionServer(Taken())
    server.on_message(0, count(2))
    times = [now_ms for now_ms in range(0, 8000, 50) if server.on_time(now_ms * MS)]
    assert times == list(range(250, 5001, 250))
    assert not server.busy
    assert said(server.on_message(9_000 * MS, item(0))) == ["ack 1 > 1"]


def test_an_acknowledgement_that_was_lost_is_given_again_and_the_mission_taken_once() -> None:
    taken = Taken()
    server = MissionServer(taken)
    for message in (count(2), item(0), item(1)):
        server.on_message(0, message)
    assert said(server.on_message(600 * MS, item(1))) == ["ack 0 > 1"]
    assert said(server.on_message(600 * MS, item(0))) == ["ack 1 > 1"]
    assert len(taken.missions) == 1


def test_two_peers_upload_at_the_same_time() -> None:
    taken = Taken()
    server = MissionServer(taken)
    heard = [server.on_message(0, message) for by in (SCOUT, OTHER) for message in (count(2, by),)]
    heard += [server.on_message(0, item(seq, by)) for seq in (0, 1) for by in (OTHER, SCOUT)]
    assert [line for messages in heard for line in said(messages)] == [
        "request 0 > 1",
        "request 0 > 3",
        "request 1 > 3",
        "request 1 > 1",
        "ack 0 > 3",
        "ack 0 > 1",
    ]
    assert taken.missions == [(OTHER, ITEMS), (SCOUT, ITEMS)]


def test_an_item_twice_or_out_of_order_is_taken_once() -> None:
    taken = Taken()
    server = MissionServer(taken)
    server.on_message(0, count(2))
    assert server.on_message(0, item(1)) == []
    server.on_message(0, item(0))
    assert server.on_message(0, item(0)) == []
    server.on_message(0, item(1))
    assert taken.missions == [(SCOUT, ITEMS)]


@pytest.mark.parametrize(("message", "answer"), [(count(0), 4), (count(21), 4), (count(2, mission_type=1), 3)])
def test_what_is_not_served_is_refused_at_once(message: Any, answer: int) -> None:
    server = MissionServer(Taken())
    assert said(server.on_message(0, message)) == [f"ack {answer} > 1"]
    assert not server.busy


def test_what_its_owner_does_not_want_is_refused() -> None:
    server = MissionServer(Taken(result=14))
    server.on_message(0, count(2))
    server.on_message(0, item(0))
    assert said(server.on_message(0, item(1))) == ["ack 14 > 1"]
    assert said(server.on_message(0, item(1))) == ["ack 14 > 1"]


@pytest.mark.parametrize("pattern", [".", "..x", "xx...", "x...x.x.", "..x.x......x..x.x..."])
def test_the_client_half_brings_its_mission_over_a_lossy_link(pattern: str) -> None:
    taken, signs = Taken(), 0
    server = MissionServer(taken)
    client = MissionUpload(ME, ITEMS, target_component=191, tries=1000)

    def arrives() -> bool:
        nonlocal signs
        signs += 1
        return pattern[signs % len(pattern)] == "."

    for now_us in range(0, 120_000 * MS, 20 * MS):
        to_server = [on_the_wire(msg, SCOUT, 191) for msg in client.on_time(now_us)]
        to_client = server.on_time(now_us)
        while to_server or to_client:
            to_client += [answer for msg in to_server if arrives() for answer in server.on_message(now_us, msg)]
            heard = [on_the_wire(msg, ME, 191) for msg in to_client if arrives()]
            to_server, to_client = [], []
            for msg in heard:
                to_server += [on_the_wire(answer, SCOUT, 191) for answer in client.on_message(now_us, msg)]
        if client.done:
            break
    assert client.outcome is not None and client.outcome.accepted
    assert (SCOUT, ITEMS) in taken.missions
