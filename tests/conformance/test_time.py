"""PING and TIMESYNC."""

from typing import Any


def test_ping(station: Any) -> None:
    station.mav.ping_send(1, 42, 0, 0)
    reply = station.receive("PING")
    assert (reply.seq, reply.target_system, reply.target_component) == (42, 255, 190)


def test_timesync(station: Any) -> None:
    station.mav.timesync_send(0, 123456789)
    while (reply := station.receive("TIMESYNC")) is not None and reply.tc1 == 0:
        pass
    assert reply is not None
    assert reply.ts1 == 123456789
