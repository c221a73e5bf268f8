"""PING: a question to everybody is answered, with the sender as target."""

from typing import Any

import pytest

pytestmark = pytest.mark.covers("PING", source="https://mavlink.io/en/services/ping.html")


def test_ping(station: Any) -> None:
    station.mav.ping_send(1, 42, 0, 0)
    reply = station.receive("PING")
    assert (reply.seq, reply.target_system, reply.target_component) == (42, 255, 190)


def test_an_answer_is_not_answered(station: Any) -> None:
    station.mav.ping_send(1, 43, station.system, 1)
    assert station.receive("PING", 0.7) is None
