"""How the mission service begins, and that it speaks whichever of the two item messages its partner speaks."""

from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import Peer, names, only
from tests.unit.plan_messages import HOME_X, HOME_Y, count, item, upload

ACCEPTED = 0
INT, FLOAT = "MISSION_REQUEST_INT", "MISSION_REQUEST"
GLOBAL = 0


def float_item(seq: int, system: int = 1) -> Any:
    place = (HOME_X * 1e-7, HOME_Y * 1e-7, 10.0)
    return mavlink.MAVLink_mission_item_message(system, 1, seq, GLOBAL, 16, 0, 1, 0, 0, 0, 0, *place)


def int_item(seq: int, system: int = 1) -> Any:
    return mavlink.MAVLink_mission_item_int_message(system, 1, seq, GLOBAL, 16, 0, 1, 0, 0, 0, 0, HOME_X, HOME_Y, 10.0)


def float_request(seq: int, system: int = 1) -> Any:
    return mavlink.MAVLink_mission_request_message(system, 1, seq, 0)


def int_request(seq: int, system: int = 1) -> Any:
    return mavlink.MAVLink_mission_request_int_message(system, 1, seq, 0)


def test_a_service_that_has_just_begun_takes_a_clear() -> None:
    answers = only(Peer().send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0)), "MISSION_ACK")
    assert [answer.type for answer in answers] == [ACCEPTED]


def test_a_service_that_has_just_begun_is_not_busy() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_mission_set_current_message(1, 1, 0))
    assert [each.text for each in peer.texts.recent] == ["WPM: WP CURR CMD: Not in list\t"]


def test_a_service_that_has_just_begun_waits_for_nobody() -> None:
    peer = Peer()
    peer.run(6.0)
    assert not peer.texts.recent


def test_it_asks_for_integers_first() -> None:
    assert names(Peer().send(count(1))) == [INT]


@pytest.mark.parametrize("system", [1, 2])
@pytest.mark.parametrize(
    ("heard", "asks"), [(float_item, FLOAT), (int_item, INT), (float_request, FLOAT), (int_request, INT)]
)
def test_it_asks_in_the_messages_that_were_heard_last(heard: Any, asks: str, system: int) -> None:
    """Also in those that went to another system: PX4 changes before it looks at the target."""
    peer = Peer()
    for before in (float_request, int_request):
        peer.send(before(0))
        peer.send(heard(0, system))
        peer.run(6.0)
        assert only(peer.send(count(1)), asks), (before.__name__, names(peer.send(count(1))))
        peer.run(6.0)


def test_an_upload_goes_on_in_the_messages_of_its_items() -> None:
    peer = Peer()
    assert names(peer.send(count(3))) == [INT]
    assert names(peer.send(float_item(0))) == [FLOAT]
    assert names(peer.send(int_item(1))) == [INT]
    assert names(peer.send(float_item(2))) == ["MISSION_ACK"]


def test_a_download_goes_on_in_the_messages_of_its_requests() -> None:
    peer = Peer()
    assert upload(peer, item(0), item(1)) == (ACCEPTED, 0)
    peer.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    (first,) = peer.send(float_request(0))
    assert (first.get_type(), first.frame) == ("MISSION_ITEM", 3)
    assert first.x == pytest.approx(HOME_X * 1e-7)
    (second,) = peer.send(int_request(1))
    assert (second.get_type(), second.frame, second.x) == ("MISSION_ITEM_INT", 6, HOME_X)
