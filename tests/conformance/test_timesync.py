"""TIMESYNC: the other clock's time comes back with ours."""

from typing import Any


def test_timesync(station: Any) -> None:
    station.mav.timesync_send(0, 123456789)
    while (reply := station.receive("TIMESYNC")) is not None and reply.tc1 == 0:
        pass
    assert reply is not None
    assert reply.ts1 == 123456789
