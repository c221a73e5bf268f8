"""Mission protocol: up, down, refused, cleared."""

import time
from typing import Any

import pytest

X, Y = 473977418, 85455939
RELATIVE_INT = 6
QUICK_S = 5.0
PAGE = "https://mavlink.io/en/services/mission.html"


def send_item(station: Any, seq: int, command: int = 16) -> None:
    place = (0.0, 0.0, 0.0, 0.0, X, Y, 10.0)
    station.mav.mission_item_int_send(station.system, 1, seq, RELATIVE_INT, command, 0, 1, *place, 0)


def upload(station: Any, commands: list[int]) -> int:
    """Upload items of these commands; MISSION_ACK's type."""
    station.mav.mission_count_send(station.system, 1, len(commands), 0)
    while True:
        reply = station.receive(["MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"])
        assert reply is not None
        if reply.get_type() == "MISSION_ACK":
            return int(reply.type)
        send_item(station, reply.seq, commands[reply.seq])


UP = ("MISSION_COUNT", "MISSION_REQUEST_INT", "MISSION_ITEM_INT", "MISSION_ACK")
DOWN = ("MISSION_REQUEST_LIST", "MISSION_CLEAR_ALL")


@pytest.mark.covers(*UP, *DOWN, source=PAGE)
def test_up_and_down(station: Any) -> None:
    started_s = time.monotonic()
    assert upload(station, [22] + [16] * 199) == 0
    assert time.monotonic() - started_s < QUICK_S
    station.mav.mission_request_list_send(station.system, 1, 0)
    assert station.receive("MISSION_COUNT").count == 200
    for seq in range(200):
        station.mav.mission_request_int_send(station.system, 1, seq, 0)
        item = station.receive("MISSION_ITEM_INT")
        assert (item.seq, item.frame, item.x, item.y, item.z) == (seq, RELATIVE_INT, X, Y, 10.0)
    station.mav.mission_ack_send(station.system, 1, 0, 0)
    station.mav.mission_clear_all_send(station.system, 1, 0)
    assert station.receive("MISSION_ACK").type == 0
    station.mav.mission_request_list_send(station.system, 1, 0)
    assert station.receive("MISSION_COUNT").count == 0
    station.mav.mission_ack_send(station.system, 1, 0, 0)


@pytest.mark.covers("MISSION_ACK", source=PAGE)
@pytest.mark.covers(
    "MISSION_COUNT", source="measured: MAV_MISSION_UNSUPPORTED for what PX4 can't fly, NO_SPACE for 10001 items"
)
def test_refusals(station: Any) -> None:
    assert upload(station, [30]) == 3
    station.mav.mission_count_send(station.system, 1, 10001, 0)
    assert station.receive("MISSION_ACK").type == 4
